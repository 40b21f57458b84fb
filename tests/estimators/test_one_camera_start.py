"""One camera from its own start, over 50 seeds: mean NEES of the states, as docs/imu.md has it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import diagnosis, ekf, smoother
from fgbaseline.data import Estimate, Problem, Status
from fgbaseline.geometry import FloatArray, strapdown

from ..builders.inertial import simulated_problem
from .test_one_camera import state_errors

SEEDS, FRAMES = 50, np.linspace(5, 99, 20).round().astype(int)


def nees(estimate: Estimate, problem: Problem) -> FloatArray:
    """(20,) normalized squared errors of the states at `FRAMES`."""
    assert estimate.status is Status.OK
    assert estimate.state_covariance is not None
    error, P = state_errors(estimate, problem)[FRAMES], estimate.state_covariance[FRAMES]
    return np.einsum("ni,ni->n", error, np.linalg.solve(P, error[:, :, None])[:, :, 0])


@pytest.mark.full
def test_states_are_consistent_from_the_own_start() -> None:
    found: dict[str, list[FloatArray]] = {}
    for seed in range(SEEDS):
        sequence = simulated_problem("drone", seed, cameras="left").sequence
        assert sequence.truth is not None
        level = replace(sequence.truth, up=np.array([0.0, 0.0, 1.0]))  # its z axis, not that of the samples
        problem = diagnosis.calibrated(sequence.with_truth(level))
        answer = smoother.isam2(problem)
        for estimate in (answer, answer.by_products["isam2-online"], ekf.joint_ekf(problem)):
            found.setdefault(estimate.name, []).append(nees(estimate, problem))
    mean = {name: np.mean(values, axis=0) for name, values in found.items()}
    low, high = chi2.ppf([0.025, 0.975], strapdown.STATE * SEEDS) / SEEDS
    inside = {name: np.count_nonzero((values > low) & (values < high)) for name, values in mean.items()}
    assert set(inside) == {"isam2", "isam2-online", "joint-ekf"}
    assert min(inside.values()) >= 18, inside
