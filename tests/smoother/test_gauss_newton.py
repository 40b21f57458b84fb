"""What the increments led to is the whole graph's minimum already, nearly; the final relinearization takes the rest."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import gtsam
import numpy as np
import pytest

from fgbaseline import compare, data, diagnosis, smoother
from fgbaseline.compare.residuals.cost import cost
from fgbaseline.data import HuberKernel
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.data.velocity_increments import dead_reckoned_path
from fgbaseline.smoother import ISAM2Settings
from fgbaseline.smoother.batch.full_graph import full_graph
from fgbaseline.smoother.graph.gauss_newton import compact_graph, gauss_newton
from fgbaseline.smoother.graph.gtsam_conversions import values_from_state
from fgbaseline.smoother.graph.keys import AUXILIARY_POSE, landmark_key
from fgbaseline.smoother.initialization.initial_values import initial_landmarks
from fgbaseline.smoother.isam2.incremental_smoother import IncrementalSmoother

from ..builders.synthetic import drive, matched


@pytest.mark.parametrize(("kernel", "tolerance"), [(None, 1e-4), (HuberKernel(), 5e-3)])
@pytest.mark.parametrize("path", ["town", "handheld"])
def test_isam2_is_at_the_minimum_of_batch_before_and_after(
    path: PathName, kernel: HuberKernel | None, tolerance: float
) -> None:
    problem = replace(matched(drive(path, seconds=8.0, features_per_frame=20.0, wrong=0.05)), kernel=kernel)
    before = smoother.isam2(problem, settings=ISAM2Settings(relinearize_at_end=False))
    after = smoother.isam2(problem)
    batch = smoother.batch(problem, given={"isam2": after})
    np.testing.assert_array_equal(before.used, after.used)
    lowest = cost(problem, batch, batch.used)
    excess = [cost(problem, estimate, batch.used) / lowest - 1.0 for estimate in (before, after)]
    assert excess[0] < tolerance
    assert abs(excess[1]) < 0.1 * tolerance
    for estimate in (before, after):
        assert compare.divergence_summary(compare.divergence(estimate, batch))["rmse"] < 0.05


def test_without_the_final_relinearization_the_solution_differs_and_the_online_one_does_not() -> None:
    problem = matched(drive(seconds=5.0, features_per_frame=15.0))
    before = smoother.isam2(problem, settings=ISAM2Settings(relinearize_at_end=False))
    after = smoother.isam2(problem)
    assert np.abs(before.world_T_imu - after.world_T_imu).max() > 1e-9
    online = [estimate.by_products["isam2-online"].world_T_imu for estimate in (before, after)]
    np.testing.assert_array_equal(*online)


def test_settling_ends_where_every_variable_is_within_its_threshold() -> None:
    problem = replace(matched(drive(seconds=6.0, features_per_frame=15.0)), kernel=None)
    increments = IncrementalSmoother(problem, ISAM2Settings())
    increments.run(np.zeros(problem.n_frames), None)
    costs = [error(increments)]
    increments.settle()
    costs.append(error(increments))
    assert costs[1] < costs[0]
    assert increments.solver.relinearize() == 0
    batch = smoother.batch(problem)
    assert costs[1] < (1.0 + 5e-5) * cost(problem, batch, batch.used)


def error(increments: IncrementalSmoother) -> float:
    tree = increments.solver.tree
    graph = compact_graph(tree.getFactorsUnsafe())
    for i in range(graph.size()):
        if AUXILIARY_POSE in list(graph.at(i).keys()):  # linearized far off, and no part of the problem
            graph.remove(i)
    return float(compact_graph(graph).error(tree.calculateEstimate()))


def test_gauss_newton_from_far_initial_values_ends_at_the_minimum_or_reports_failure() -> None:
    problem = matched(drive(seconds=8.0, features_per_frame=20.0, wrong=0.05))
    batch = smoother.batch(problem)
    graph, path = full_graph(problem), dead_reckoned_path(problem.increment, problem.initial_pose)
    along = initial_landmarks(problem, path)
    start = values_from_state(path, replace(along, position=path[-1, :3, 3] + 1.2 * (along.position - path[-1, :3, 3])))
    lowest = cost(problem, batch, batch.used)
    assert graph.error(start) > 100.0 * lowest
    end = gauss_newton(graph, start)
    assert not end.failure
    assert graph.error(end.values) < (1.0 + 1e-4) * lowest
    early = gauss_newton(graph, start, max_steps=2)
    assert "still falls after 2" in early.failure
    assert graph.error(early.values) > 2.0 * lowest


def test_a_landmark_that_no_camera_sees_leaves_the_others_at_their_minimum() -> None:
    """Behind its cameras a landmark has zero Jacobians (GTSAM), so that the system is indeterminate."""
    problem = matched(drive(seconds=4.0, features_per_frame=20.0))
    path = dead_reckoned_path(problem.increment, problem.initial_pose)
    landmarks = initial_landmarks(problem, path)
    graph, start = full_graph(problem), values_from_state(path, landmarks)
    key = landmark_key(int(landmarks.index[0]))
    start.update(key, start.atPoint3(key) - 1e4 * path[-1, :3, 0])
    with pytest.raises(RuntimeError, match="Indeterminate"):
        graph.linearize(start).optimize()
    others = gtsam.NonlinearFactorGraph()
    for factor in (graph.at(i) for i in range(graph.size())):
        if key not in factor.keys():  # noqa: SIM118 (of a factor)
            others.add(factor)
    end = gauss_newton(graph, start)
    lowest = gauss_newton(others, values_from_state(path, landmarks)).values
    assert others.error(end.values) < (1.0 + 1e-4) * others.error(lowest)


@pytest.mark.slow
def test_a_recording_in_wrong_axes_ends_at_the_minimum_too(recordings: Callable[[str], Path]) -> None:
    sequence = data.read(recordings("utias/2011_09_26_drive_0009_sync_KLT.mat"))
    problem = diagnosis.calibrated(sequence, settings=diagnosis.AsRecordedSettings())
    answer = smoother.isam2(problem)
    batch = smoother.batch(problem, given={"isam2": answer})
    assert cost(problem, answer, batch.used) < (1.0 + 1e-5) * cost(problem, batch, batch.used)
