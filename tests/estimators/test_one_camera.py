"""One camera with raw inertial samples, from a given start: estimators find path and scale, and know their errors."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline import compare, ekf, smoother
from fgbaseline.compare.residuals.noise_scale import pixel_scale
from fgbaseline.data import Estimate, Problem, Status
from fgbaseline.geometry import FgbaselineError, FloatArray

from ..builders.inertial import simulated_problem, state_errors

SEEDS = 8
FRAMES = (20, 60, 99)


def nees(estimate: Estimate, problem: Problem) -> FloatArray:
    """(3,) normalized squared errors of the states at `FRAMES`."""
    assert estimate.state_covariance is not None
    at = list(FRAMES)
    error, P = state_errors(estimate, problem)[at], estimate.state_covariance[at]
    return np.einsum("ni,ni->n", error, np.linalg.solve(P, error[:, :, None])[:, :, 0])


def scale(estimate: Estimate, problem: Problem) -> float:
    """Estimated over true length of the path, by least squares."""
    truth = problem.sequence.truth
    assert truth is not None
    ours, true = (poses[:, :3, 3] - poses[:, :3, 3].mean(axis=0) for poses in (estimate.world_T_imu, truth.world_T_imu))
    return float(np.sum(ours * true) / np.sum(true * true))


@pytest.fixture(scope="module")
def problems() -> list[Problem]:
    return [simulated_problem("drone", seed, cameras="left") for seed in range(SEEDS)]


@pytest.mark.parametrize("name", ["isam2", "fixed-lag", "joint-ekf"])
def test_states_are_consistent_and_the_scale_is_found(name: str, problems: list[Problem]) -> None:
    solve = {"isam2": smoother.isam2, "fixed-lag": smoother.fixed_lag, "joint-ekf": ekf.joint_ekf}[name]
    answers = [(solve(problem), problem) for problem in problems]
    assert all(answer.status is not Status.FAILED for answer, _ in answers)
    assert all(abs(scale(answer, problem) - 1.0) < 0.03 for answer, problem in answers)
    found = {name: [nees(answer, problem) for answer, problem in answers]}
    if name == "isam2":
        online = [(answer.by_products["isam2-online"], problem) for answer, problem in answers]
        found["isam2-online"] = [nees(answer, problem) for answer, problem in online]
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], 15 * SEEDS) / SEEDS
    for values in found.values():
        mean = np.mean(values, axis=0)
        assert (mean > low).all(), mean
        assert (mean < high).all(), mean


def test_batch_agrees_with_isam2(problems: list[Problem]) -> None:
    answer = smoother.isam2(problems[0])
    minimum = smoother.batch(problems[0], given={"isam2": answer})
    apart = minimum.world_T_imu[:, :3, 3] - answer.world_T_imu[:, :3, 3]
    assert np.abs(apart).max() < 1e-4
    used = answer.used & minimum.used
    assert compare.cost(problems[0], answer, used) == pytest.approx(compare.cost(problems[0], minimum, used), rel=1e-6)


def test_the_pixel_noise_is_found_over_two_rows(problems: list[Problem]) -> None:
    scales = [pixel_scale(problem, smoother.isam2(problem)) for problem in problems[:3]]
    assert np.abs(np.array(scales) - 1.0).max() < 0.05


def test_what_one_camera_cannot_do_is_refused_by_name(problems: list[Problem]) -> None:
    with pytest.raises(FgbaselineError, match="ekf needs a stereo camera"):
        ekf.ekf(problems[0])
    with pytest.raises(FgbaselineError, match="joint-ekf-textbook needs a stereo camera"):
        ekf.joint_ekf_textbook(problems[0])
    with pytest.raises(FgbaselineError, match="inverse_depth_prior"):
        ekf.joint_ekf(replace(problems[0], inverse_depth_prior=None))
