"""What the documented filter does where the printed equations lose their digits, and without a landmark prior."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import data, diagnosis, ekf
from fgbaseline.data import Estimate, LandmarkMode, Problem, Status
from fgbaseline.data.simulate import KITTI
from fgbaseline.data.velocity_increments import back_project, dead_reckoned_path
from fgbaseline.ekf.decoupled_ekf import _standard_form_failure
from fgbaseline.ekf.landmark_mapping import map_landmarks
from fgbaseline.ekf.landmark_update import IndependentLandmarks
from fgbaseline.geometry import FloatArray, HuberKernel, se3
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.measurement_model import three_rows

from ..builders.synthetic import Scene, drive, first_innovation, matched, plain_problem, position_errors


def moved_start(problem: Problem, landmark: int, start: FloatArray) -> Problem:
    """The problem with the prior of one landmark elsewhere."""
    assert problem.landmark_prior is not None
    mean = problem.landmark_prior.mean.copy()
    mean[landmark] = start
    return replace(problem, landmark_prior=replace(problem.landmark_prior, mean=mean))


def late_landmark(sequence: data.Sequence, frame: int) -> data.Sequence:
    """The recording without what was seen of landmark 0 before a frame."""
    o = sequence.observations
    return replace(sequence, observations=o.select((o.landmark != 0) | (o.frame >= frame)))


def at_camera_plane(depth: float) -> tuple[Problem, int]:
    """A problem in which landmark 0, first seen at frame 4, starts `depth` in front of that frame's camera."""
    frame = 4
    problem = data.documented(late_landmark(Scene(sigma_velocity=(0.0, 0.0)).sequence(), frame))
    before = ekf.ekf(problem).world_T_imu[frame - 1] @ se3.exp(problem.increment[frame - 1])
    start = se3.transform(before @ problem.sequence.imu_T_cam, np.array([3.0, 1.0, depth]))
    return moved_start(problem, 0, start), frame


def assert_covariances(estimate: Estimate) -> None:
    """Symmetric to the last digit, and not negative."""
    assert estimate.covariance is not None
    assert estimate.landmarks.covariance is not None
    for covariance in (estimate.covariance[1:], estimate.landmarks.covariance):
        np.testing.assert_array_equal(covariance, np.swapaxes(covariance, 1, 2))
        unit = 1.0 / np.sqrt(np.einsum("nii->ni", covariance))
        assert np.linalg.eigvalsh(covariance * unit[:, :, None] * unit[:, None, :]).min() > -1e-12


@pytest.mark.parametrize("depth", [1e-5, -1e-5, 1e-9])
def test_a_landmark_in_the_camera_plane_is_reported_and_the_run_continues(depth: float) -> None:
    problem, frame = at_camera_plane(depth)
    estimate = ekf.ekf(problem)
    assert estimate.status is Status.RECOVERED
    assert estimate.events[0].frame == frame
    assert estimate.events[0].kind == "innovation covariance singular"
    assert "with a condition number of " in estimate.events[0].reason
    assert f"first at frame {frame}" in estimate.reason
    assert np.isfinite(estimate.world_T_imu).all()
    assert_covariances(estimate)


def test_the_same_landmark_farther_away_is_no_event() -> None:
    problem, _ = at_camera_plane(3.0)
    estimate = ekf.ekf(problem)
    assert estimate.status is Status.OK
    assert estimate.events == ()


def test_a_landmark_in_the_camera_plane_fails_with_its_frame_and_earlier_poses_are_kept() -> None:
    frame = 4
    sequence = Scene(velocity=(0.0,) * 6, sigma_velocity=(0.0, 0.0)).sequence()
    sequence = replace(
        late_landmark(sequence, frame),
        linear_velocity=np.zeros((10, 3)),
        angular_velocity=np.zeros((10, 3)),
        imu_T_cam=np.eye(4),
    )
    problem = data.documented(sequence, landmark_mode=LandmarkMode.UPDATED)
    # Without motion and with a camera at the IMU, the plane z = 0 of the first frame is hit to the last bit.
    o = sequence.observations
    only_late = replace(sequence, observations=o.select(o.frame >= frame))
    problem = moved_start(data.documented(only_late), 0, np.array([3.0, 1.0, 0.0]))
    estimate = ekf.ekf(problem)
    assert estimate.status is Status.FAILED
    assert f"frame {frame}" in estimate.reason
    assert "not finite" in estimate.reason
    assert np.isfinite(estimate.world_T_imu[:frame]).all()
    assert np.isnan(estimate.world_T_imu[frame:]).all()
    np.testing.assert_array_equal(estimate.used, False)


def test_without_observations_there_is_no_filter_but_dead_reckoning_remains() -> None:
    sequence = replace(drive(), observations=data.Observations.none())
    problem = diagnosis.calibrated(sequence, settings=diagnosis.AsRecordedSettings())
    estimate = ekf.ekf(problem)
    assert estimate.status is Status.FAILED
    assert estimate.reason == "no observations"
    assert np.isnan(estimate.world_T_imu).all()
    remaining = ekf.dead_reckoning(problem)
    assert remaining.status is Status.OK
    np.testing.assert_array_equal(remaining.world_T_imu, dead_reckoned_path(problem.increment))


def test_a_frame_without_observations_is_a_prediction() -> None:
    sequence = drive()
    o = sequence.observations
    problem = data.documented(replace(sequence, observations=o.select(o.frame != 20)), None)
    estimate = ekf.ekf(problem)
    assert estimate.covariance is not None
    expected = estimate.world_T_imu[19] @ se3.exp(problem.increment[19])
    np.testing.assert_allclose(estimate.world_T_imu[20], expected, rtol=0, atol=1e-14)
    assert np.all(np.diagonal(estimate.covariance[20]) > np.diagonal(estimate.covariance[19]))


def test_on_clean_data_the_filter_is_nearer_to_the_truth_than_dead_reckoning() -> None:
    squares = []
    for path in ("town", "loop", "handheld"):
        for seed in (1, 2, 3):
            sequence = drive(path, seconds=20.0, features_per_frame=70.0, seed=seed)
            problem = diagnosis.calibrated(sequence, settings=diagnosis.AsRecordedSettings())
            filtered, reckoned = ekf.ekf(problem), ekf.dead_reckoning(problem)
            assert filtered.status is Status.OK
            assert_covariances(filtered)
            np.testing.assert_array_equal(filtered.used, problem.mask)
            ours, theirs = (np.mean(position_errors(e, sequence) ** 2) for e in (filtered, reckoned))
            assert ours < theirs
            assert np.sqrt(ours) < 0.5
            squares.append((ours, theirs))
    ours, theirs = np.sqrt(np.mean(squares, axis=0))
    assert ours < 0.5 * theirs


@given(st.integers(0, 10_000))
def test_a_landmark_without_prior_is_initialized_by_its_first_observation_and_its_covariance(seed: int) -> None:
    problem = plain_problem(Scene(frames=2, n_points=5, seed=seed).sequence())
    pose = se3.exp(np.random.default_rng(seed).normal(size=6))
    pixel = problem.sequence.observations.pixel[:5]
    blocks = IndependentLandmarks(problem, problem.measurement)  # V = 0.25 px^2
    blocks.update(pose, np.arange(5), pixel, np.ones(5))
    in_camera = problem.sequence.camera.triangulate(pixel)
    # The right image's row moves the point a little, since depth and height come from uL, vL, uR only.
    start = se3.transform(pose @ KITTI.imu_T_cam, in_camera)
    R = (pose @ KITTI.imu_T_cam)[:3, :3].T
    H = problem.sequence.camera.jacobian(in_camera) @ R
    information = 4.0 * np.swapaxes(H, 1, 2) @ H
    innovation = pixel - problem.sequence.camera.project(in_camera)
    step = np.linalg.solve(information, (4.0 * np.swapaxes(H, 1, 2) @ innovation[:, :, None]))[:, :, 0]
    np.testing.assert_allclose(blocks.mean, start + step, rtol=1e-9, atol=1e-9)
    R = blocks.root_information
    np.testing.assert_allclose(np.swapaxes(R, 1, 2) @ R, information, rtol=1e-9, atol=1e-9 * information.max())


def test_a_mapped_landmark_is_where_its_rays_intersect() -> None:
    sequence = Scene(sigma_pixel=0.0, sigma_velocity=(0.0, 0.0)).sequence()
    problem = plain_problem(sequence)
    blocks, _ = map_landmarks(problem, dead_reckoned_path(problem.increment))
    assert sequence.truth is not None
    assert sequence.truth.landmarks is not None
    np.testing.assert_allclose(blocks.mean, sequence.truth.landmarks, rtol=1e-8, atol=1e-8)


def test_the_landmarks_of_dead_reckoning_are_the_average_back_projections() -> None:
    problem = data.documented(drive(), 20)
    points = back_project(problem.sequence, dead_reckoned_path(problem.increment))
    o = problem.sequence.observations
    expected = [points[o.landmark == j].mean(axis=0) for j in problem.features]
    landmarks = ekf.dead_reckoning(problem).landmarks
    np.testing.assert_array_equal(landmarks.index, problem.features)
    np.testing.assert_allclose(landmarks.position, expected, rtol=1e-12, atol=1e-12)


def test_progress_is_reported_after_every_frame_and_the_time_is_measured() -> None:
    calls: list[tuple[int, int]] = []
    problem = matched(drive())
    for estimator in (ekf.ekf, ekf.landmark_mapping):
        calls.clear()
        estimate = estimator(problem, lambda done, total: calls.append((done, total)))
        assert calls == [(k + 1, 50) for k in range(50)]
        assert estimate.seconds.shape == (50,)
        assert np.all(estimate.seconds >= 0.0)
        assert estimate.seconds_total >= estimate.seconds.sum() > 0.0


def test_a_problem_is_not_changed_by_solving_it() -> None:
    problem = data.documented(drive(), 20)
    assert problem.landmark_prior is not None
    arrays = (problem.increment, problem.landmark_prior.mean, problem.excluded, problem.initial_covariance)
    before = [array.copy() for array in arrays]
    first = ekf.ekf(problem)
    for array, kept in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(array, kept)
    np.testing.assert_array_equal(ekf.ekf(problem).world_T_imu, first.world_T_imu)


def test_the_lost_definiteness_of_the_printed_covariance_is_an_event_with_its_eigenvalue() -> None:
    innovation = first_innovation(Scene().sequence(), np.eye(4))
    weight = np.ones(12)
    assert _standard_form_failure(1e-6 * np.eye(6), innovation, weight) == ""
    # So small beside the noise of the pixels that the gain changes nothing.
    lost = "leaves (I - K H) Sigma as printed with an eigenvalue of -1.0e-12"
    assert _standard_form_failure(-1e-12 * np.eye(6), innovation, weight) == lost
    assert _standard_form_failure(np.zeros((6, 6)), innovation, weight).endswith("an eigenvalue of 0.0e+00")


def test_a_singular_innovation_is_an_event_with_condition_number_and_eigenvalue() -> None:
    problem, frame = at_camera_plane(1e-5)
    estimate = ekf.ekf(problem)
    assert re.fullmatch(
        r"H Sigma H\^T \+ V, with a condition number of \d\.\de\+\d\d from a landmark near the camera plane, "
        r"(has no inverse in double precision|leaves \(I - K H\) Sigma as printed with an eigenvalue of -\d\.\de.\d\d)",
        estimate.events[0].reason,
    )
    frames = len({event.frame for event in estimate.events})
    assert len(estimate.events) == frames
    assert estimate.reason == (
        f"the innovation covariance was numerically singular at {frames} of 10 frames, first at frame {frame}: "
        "the printed equations lose positive definiteness there, the form used here does not"
    )


@given(st.integers(0, 10_000), st.floats(0.5, 4.0))
def test_mapping_weighs_an_innovation_by_its_own_covariance(seed: int, threshold: float) -> None:
    kernel = HuberKernel(threshold)
    problem = plain_problem(Scene(frames=2, n_points=5, seed=seed).sequence(), kernel)
    pixel, cam_T_imu = problem.sequence.observations.pixel, se3.inverse(KITTI.imu_T_cam)
    wrong = pixel[5:] + np.random.default_rng(seed).normal(size=(5, 4)) * 3.0
    blocks, expected = (IndependentLandmarks(problem, problem.measurement) for _ in range(2))
    for each in (blocks, expected):
        each.update(np.eye(4), np.arange(5), pixel[:5])
    sigma, predicted = blocks.covariance(), predict(KITTI.camera, cam_T_imu, np.eye(4), blocks.mean)
    H, residual = predicted.point_jacobian()[:, :, :3], three_rows(wrong) - predicted.pixel
    S = H @ sigma @ np.swapaxes(H, 1, 2) + 0.25 * np.diag([1.0, 1.0, 0.5])
    norm = np.sqrt([r @ np.linalg.solve(s, r) for r, s in zip(residual, S, strict=True)])
    expected.update(np.eye(4), np.arange(5), wrong, np.minimum(1.0, threshold / norm))
    blocks.update(np.eye(4), np.arange(5), wrong)
    np.testing.assert_allclose(blocks.mean, expected.mean, rtol=1e-7)
