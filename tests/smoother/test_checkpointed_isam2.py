"""An update either succeeds or changes nothing."""

import gtsam
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.measurement_model import three_rows
from fgbaseline.smoother.errors import IndeterminateSystemError
from fgbaseline.smoother.graph.factors import FactorBuilder
from fgbaseline.smoother.graph.keys import landmark_key, pose_key
from fgbaseline.smoother.isam2.checkpointed_isam2 import CheckpointedISAM2

from ..builders.synthetic import Scene, plain_problem

PROBLEM = plain_problem(Scene(frames=12, n_points=6).sequence())
FACTORS = FactorBuilder(PROBLEM)
TRUTH = PROBLEM.sequence.truth


def parameters(skip: int = 1) -> gtsam.ISAM2Params:
    params = gtsam.ISAM2Params()
    params.setRelinearizeThreshold(0.01)
    params.relinearizeSkip = skip
    return params


def frame(k: int) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
    """What frame k brings, started at the truth."""
    assert TRUTH is not None
    assert TRUTH.landmarks is not None
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    graph.push_back(FACTORS.pose_prior() if k == 0 else FACTORS.between(k - 1))
    values.insert(pose_key(k), gtsam.Pose3(TRUTH.world_T_imu[k]))
    o = PROBLEM.observations()
    for i in np.flatnonzero(o.frame == k):
        graph.push_back(FACTORS.observation(k, landmark_key(int(o.landmark[i])), three_rows(o.pixel[i])))
    if k == 0:
        for j, point in enumerate(TRUTH.landmarks):
            values.insert(landmark_key(j), point)
    return graph, values


def behind_the_camera(isam: CheckpointedISAM2, k: int) -> None:
    """An update with a new landmark behind the camera, whose Jacobian is zero."""
    assert TRUTH is not None
    graph, values = frame(k)
    graph.push_back(FACTORS.observation(k, landmark_key(99), np.array([600.0, 590.0, 180.0])))
    values.insert(landmark_key(99), (TRUTH.world_T_imu[k] @ PROBLEM.sequence.imu_T_cam @ [0.0, 0.0, -20.0, 1.0])[:3])
    isam.update(graph, values)


def unknown_variable(isam: CheckpointedISAM2, k: int) -> None:
    """An update with a factor on a variable that is not there."""
    graph, values = frame(k)
    graph.push_back(FACTORS.observation(k, landmark_key(98), np.array([600.0, 590.0, 180.0])))
    isam.update(graph, values)


def everything(isam: CheckpointedISAM2) -> FloatArray:
    values = isam.tree.calculateEstimate()
    poses = [values.atPose3(key).matrix().ravel() for key in values.keys() if chr(gtsam.Symbol(key).chr()) == "x"]  # noqa: SIM118
    points = [values.atPoint3(key) for key in values.keys() if chr(gtsam.Symbol(key).chr()) != "x"]  # noqa: SIM118
    return np.concatenate([*poses, *points])


@pytest.mark.parametrize("failure", [behind_the_camera, unknown_variable])
@pytest.mark.parametrize("interval", [1, 3, 50])
@pytest.mark.parametrize("skip", [1, 3])
def test_after_a_failed_update_the_estimate_is_restored(failure: object, interval: int, skip: int) -> None:
    assert callable(failure)
    isam = CheckpointedISAM2(parameters(skip), interval)
    for k in range(8):
        isam.update(*frame(k))
    before, slots = everything(isam), isam.tree.getFactorsUnsafe().size()
    with pytest.raises(IndeterminateSystemError):
        failure(isam, 8)
    np.testing.assert_array_equal(everything(isam), before)
    assert isam.tree.getFactorsUnsafe().size() == slots
    assert not isam.tree.valueExists(pose_key(8))


def test_held_variables_keep_their_linearization_points() -> None:
    assert TRUTH is not None
    isam = CheckpointedISAM2(parameters())
    isam.update(*frame(0))
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for k in range(1, 4):
        graph.push_back(frame(k)[0])
        values.insert(pose_key(k), gtsam.Pose3(TRUTH.world_T_imu[k] @ se3.exp([0.5, 0.0, 0.0, 0.0, 0.0, 0.1])))
    isam.update(graph, values)
    held = gtsam.KeyList()
    held.push_back(pose_key(2))
    isam.update(gtsam.NonlinearFactorGraph(), gtsam.Values(), relinearize=True, no_relin_keys=held)
    point, estimate = isam.tree.getLinearizationPoint(), isam.tree.calculateEstimate()
    stays, *moved = (point.atPose3(pose_key(k)).equals(values.atPose3(pose_key(k)), 1e-9) for k in (2, 1, 3))
    assert stays
    assert moved == [False, False]
    assert estimate.atPose3(pose_key(2)).localCoordinates(gtsam.Pose3(TRUTH.world_T_imu[2])) == pytest.approx(
        0, abs=0.1
    )


def test_the_failure_names_the_variable_where_gtsam_does() -> None:
    isam = CheckpointedISAM2(parameters())
    isam.update(*frame(0))
    with pytest.raises(IndeterminateSystemError) as caught:
        behind_the_camera(isam, 1)
    assert caught.value.key == landmark_key(99)


@settings(max_examples=15, deadline=None)
@given(st.sets(st.integers(1, 11)), st.integers(1, 5))
def test_a_run_with_failures_is_the_run_without_them_slot_for_slot(failing: set[int], interval: int) -> None:
    smooth, troubled = CheckpointedISAM2(parameters(), 50), CheckpointedISAM2(parameters(), interval)
    for k in range(12):
        if k in failing:
            with pytest.raises(IndeterminateSystemError):
                behind_the_camera(troubled, k)
        # Every third frame takes an observation of the frame before away again.
        removed = [] if k % 3 or k == 0 else [smooth.tree.getFactorsUnsafe().size() - 1]
        one, other = (list(isam.update(*frame(k), removed).getNewFactorsIndices()) for isam in (smooth, troubled))
        assert one == other
    np.testing.assert_allclose(everything(troubled), everything(smooth), rtol=0, atol=1e-9)
