"""Marginal covariances of inertial states are those of dense algebra, however long the recording is."""

from collections.abc import Iterable

import gtsam
import numpy as np
import pytest
from scipy.linalg import eigh

from fgbaseline import compare, smoother
from fgbaseline.geometry import FloatArray
from fgbaseline.smoother import ISAM2Settings
from fgbaseline.smoother.graph import frame_states
from fgbaseline.smoother.graph.frame_states import FrameStates
from fgbaseline.smoother.graph.gtsam_conversions import in_solver_frame
from fgbaseline.smoother.graph.marginal_covariances import marginal_covariances
from fgbaseline.smoother.isam2.incremental_smoother import IncrementalSmoother

from ..builders.inertial import inertial_problem, simulated_problem

DIMENSIONS = {"x": 6, "v": 3, "w": 6}
"""of a variable by the letter of its key; landmarks have three"""


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_smoothed_covariances_equal_dense_qr_and_end_at_the_online_one(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[gtsam.NonlinearFactorGraph, gtsam.Values, list[list[int]]]] = []

    def recorded(
        graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, joint: Iterable[list[int]] = ()
    ) -> dict[int, FloatArray]:
        asked.append((graph, values, [list(keys) for keys in joint]))
        return marginal_covariances(graph, values, joint)

    monkeypatch.setattr(frame_states, "marginal_covariances", recorded)
    estimate = smoother.isam2(inertial_problem(seed))
    graph, values, frames = asked[-1]
    found = marginal_covariances(graph, values, frames)
    A, _ = graph.linearize(values).jacobian()
    inverse = np.linalg.inv(np.linalg.qr(A, mode="r"))
    columns, end = {}, 0
    for key in sorted(values.keys()):
        columns[key] = range(end, end + DIMENSIONS.get(chr(key >> 56), 3))
        end = columns[key].stop
    assert end == A.shape[1]
    for keys in frames:
        rows = inverse[[i for key in keys for i in columns[key]]]
        dense = rows @ rows.T
        sigma = np.sqrt(np.diag(dense))
        np.testing.assert_allclose(found[keys[0]] / np.outer(sigma, sigma), dense / np.outer(sigma, sigma), atol=1e-7)
    assert estimate.state_covariance is not None
    online = estimate.by_products["isam2-online"].state_covariance
    assert online is not None
    last = [np.sqrt(np.diag(P[-1])) for P in (estimate.state_covariance, online)]
    np.testing.assert_allclose(last[0], last[1], rtol=0.05)  # online the last frame has the weights of its prediction


@pytest.mark.parametrize("seed", range(3))
def test_online_covariances_are_those_of_the_robust_graph_at_the_online_estimate(seed: int) -> None:
    """For every direction of the state; GTSAM's robust factors, weighted at the linearization point, are 15 % off."""
    problem, _ = in_solver_frame(simulated_problem("town", seed, seconds=2.2))
    incremental = IncrementalSmoother(problem, ISAM2Settings.of(problem))
    incremental.run(np.zeros(problem.n_frames), None)
    at_estimate = FrameStates.unknown(problem)
    at_estimate.take_marginals(problem, *incremental.release())
    ratio = eigh(incremental.builder.online.covariance[-1], at_estimate.covariance[-1], eigvals_only=True)
    np.testing.assert_allclose(ratio, 1.0, atol=0.05)


def test_smoothed_and_online_states_are_consistent_over_seeds() -> None:
    frames = [5, 15, 25]
    nees = np.zeros((2, len(frames)))
    seeds = range(12)
    for seed in seeds:
        problem = inertial_problem(seed, n_frames=26)
        estimate = smoother.isam2(problem)
        assert problem.sequence.truth is not None
        for i, answer in enumerate((estimate, estimate.by_products["isam2-online"])):
            nees[i] += compare.state_nees(answer, problem.sequence.truth)["state"].to_numpy()[frames] / len(seeds)
    low, high = compare.chi_square_bounds(15, len(seeds), 0.999)
    assert np.all((nees > low) & (nees < high)), nees
