"""Landmarks that one camera sees for the first time begin in the scale that the state has, and say nothing of it."""

from typing import Literal

import numpy as np
import pytest

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.problem import InverseDepthPrior
from fgbaseline.ekf.joint import estimators
from fgbaseline.ekf.joint.filter import JointFilter
from fgbaseline.ekf.joint.landmark_representation import LandmarkRepresentation, chart
from fgbaseline.ekf.joint.monocular.inverse_depth_prior import inverse_depths, scene_depth
from fgbaseline.ekf.joint.settings import JointSettings
from fgbaseline.geometry import FloatArray, se3

from ..builders.inertial import simulated_problem

STEP = 1e-6


def test_jacobians_of_the_inverse_depth_are_its_finite_differences() -> None:
    random = np.random.default_rng(2)
    cam_T_imu, pose, first, second = se3.exp(0.3 * random.normal(size=(4, 6)))
    anchors = (pose @ se3.inverse(cam_T_imu))[None] @ np.stack([first, second])
    charts = np.stack([chart(LandmarkRepresentation.INVERSE_DEPTH, anchor) for anchor in anchors])
    xi = np.column_stack([random.uniform(-0.2, 0.2, (2, 2)), [0.3, 0.2]])
    _, by_pose, by_xi = inverse_depths(pose, cam_T_imu, charts, xi)

    def at(moved: FloatArray, coordinates: FloatArray) -> FloatArray:
        return inverse_depths(moved, cam_T_imu, charts, coordinates)[0]

    for i, e in enumerate(STEP * np.eye(6)):
        slope = (at(pose @ se3.exp(e), xi) - at(pose @ se3.exp(-e), xi)) / (2.0 * STEP)
        np.testing.assert_allclose(by_pose[:, i], slope, atol=1e-7)
    for i, e in enumerate(STEP * np.eye(3)):
        slope = (at(pose, xi + e) - at(pose, xi - e)) / (2.0 * STEP)
        np.testing.assert_allclose(by_xi[:, i], slope, atol=1e-7)


def test_more_landmarks_do_not_narrow_the_scale() -> None:
    """ln of the mean inverse depth of new landmarks has the variance of the scene's, whatever their number."""
    problem = simulated_problem("drone", 3, seconds=3.0, cameras="left")
    run = JointFilter(problem, JointSettings())
    frames = list(problem.observations().by_frame(problem.n_frames))
    for k, seen in enumerate(frames[:20]):
        run.process_frame(k, seen)
    before, scene = run.state.size, scene_depth(InverseDepthPrior(0.3, 0.15), run.state, run.cam_T_imu)
    assert scene.spread == 0.5
    assert np.sqrt(scene.variance) < 0.2
    new = np.flatnonzero(run.state.slot_of[: run.state.n_features] < 0)
    index = np.array([np.flatnonzero(run.feature == row)[0] for row in new])
    run._initialize_from_observation(index)  # the law is of this step alone
    state, n = run.state, len(index)
    slope = np.zeros(state.size)
    slope[before + 2 :: 3] = 1.0 / (n * state.xi[-n:, 2])
    assert n > 50
    mean_variance = float(slope @ state.P @ slope)
    expected = scene.variance + scene_spread(problem.inverse_depth_prior) ** 2 / n
    assert abs(mean_variance / expected - 1.0) < 0.1


def scene_spread(prior: InverseDepthPrior | None) -> float:
    assert prior is not None
    return prior.sigma / prior.mean


@pytest.mark.parametrize("cameras", ["left", "stereo"])
def test_variants_reject_whole_frames_only_where_the_filter_does(
    cameras: Literal["left", "stereo"], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = simulated_problem("drone", 3, seconds=3.0, cameras=cameras)
    used: list[JointSettings] = []

    def run(problem: Problem, progress: object, settings: JointSettings) -> Estimate:
        used.append(settings)
        return Estimate.failed("joint-ekf", "not run", problem.n_frames, len(problem.excluded))

    monkeypatch.setattr(estimators, "_run", run)
    for solve in (estimators.joint_ekf, estimators.joint_ekf_first_estimate, estimators.joint_ekf_ungated):
        solve(problem)
    assert {each.disagreeing_share for each in used} == {JointSettings.of(problem).disagreeing_share}
    assert len(used) == 3
