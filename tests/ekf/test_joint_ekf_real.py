"""The joint filter on real recordings."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, data, diagnosis, ekf
from fgbaseline.data import Estimate, Sequence, Status
from fgbaseline.ekf import JointSettings
from fgbaseline.geometry import FloatArray

from ..builders.synthetic import first_frames

Recordings = Callable[[str], Path]
UTIAS = [
    "2011_09_26_drive_0001_sync_KLT",
    "2011_09_26_drive_0005_sync_KLT",
    "2011_09_26_drive_0009_sync_KLT",
    "2011_09_26_drive_0036_sync_KLT",
    "2011_09_30_drive_0027_sync_KLT",
]
LINEAR_NOISE, ANGULAR_NOISE = 0.5, 0.05
"""m/s and rad/s"""


def noisy(sequence: Sequence) -> Sequence:
    """The recording with noise on its velocities, which came with hardly any."""
    random = np.random.default_rng(0)
    shape = sequence.linear_velocity.shape
    return replace(
        sequence,
        linear_velocity=sequence.linear_velocity + LINEAR_NOISE * random.normal(size=shape),
        angular_velocity=sequence.angular_velocity + ANGULAR_NOISE * random.normal(size=shape),
    )


def ate(estimate: Estimate, sequence: Sequence) -> float:
    """RMSE of position after SE(3) alignment, m."""
    assert sequence.truth is not None
    return compare.summarized(compare.truth_errors(estimate, sequence.truth, aligned=True)["position"])["rmse"]


def assert_covariances(covariances: FloatArray) -> None:
    np.testing.assert_array_equal(covariances, np.swapaxes(covariances, 1, 2))
    unit = 1.0 / np.sqrt(np.einsum("nii->ni", covariances))
    assert np.linalg.eigvalsh(covariances * unit[:, :, None] * unit[:, None, :]).min() > -1e-9


@pytest.mark.slow
def test_on_the_reports_recording_every_frame_is_estimated(recordings: Recordings) -> None:
    sequence = data.read(recordings("03.npz"))
    sequence = replace(sequence, angular_velocity=sequence.angular_velocity * [1.0, -1.0, -1.0])
    problem = diagnosis.calibrated(sequence)
    estimate = ekf.joint_ekf(problem)
    assert estimate.status is not Status.FAILED
    assert np.isfinite(estimate.world_T_imu).all()
    assert estimate.covariance is not None
    assert estimate.landmarks.covariance is not None
    assert_covariances(estimate.covariance[1:])
    assert_covariances(estimate.landmarks.covariance)
    assert estimate.used[problem.mask].mean() > 0.95
    assert len(estimate.landmarks) > 0.95 * len(problem.features)


@pytest.mark.slow
def test_on_noisy_velocities_it_halves_the_error_of_dead_reckoning(recordings: Recordings) -> None:
    truth = recordings("ground_truth/kitti_odometry_07.txt")
    sequence = first_frames(data.read(recordings("ece276a_2020/0027.npz"), truth, "camera"), 550)
    problem = diagnosis.calibrated(sequence)
    reckoned = ate(ekf.dead_reckoning(problem), sequence)
    ours, textbook = (ate(ekf.joint_ekf(problem, settings=how), sequence) for how in (None, JointSettings.textbook()))
    assert ours < 0.5 * reckoned
    assert ours < textbook


@pytest.mark.slow
def test_with_noise_added_to_the_velocities_it_beats_dead_reckoning_and_the_textbook(recordings: Recordings) -> None:
    calibration = diagnosis.AsRecordedSettings(noise=diagnosis.NoiseSettings(1.5, LINEAR_NOISE, ANGULAR_NOISE))
    squares = []
    for name in UTIAS:
        sequence = noisy(data.read(recordings(f"utias/{name}.mat")))
        problem = diagnosis.calibrated(sequence, settings=calibration)  # the filter is on trial here, not the diagnosis
        answers = ekf.joint_ekf(problem), ekf.joint_ekf(problem, settings=JointSettings.textbook())
        assert answers[0].status is not Status.FAILED
        squares.append([ate(e, sequence) ** 2 for e in (*answers, ekf.dead_reckoning(problem))])
    ours, textbook, reckoned = np.sqrt(np.mean(squares, axis=0))
    assert ours < 0.8 * textbook
    assert ours < 0.8 * reckoned


def test_landmarks_observed_again_keep_their_identity(recordings: Recordings) -> None:
    problem = diagnosis.calibrated(data.read(recordings("utias/dataset3.mat")))
    problem = replace(problem, pixel_variance=40.0)  # about what the recording comes with
    o = problem.observations()
    span = np.array([np.ptp(o.frame[o.landmark == j]) + 1 for j in problem.features])
    assert np.any(span > o.counts(problem.sequence.n_landmarks)[problem.features])
    estimate = ekf.joint_ekf(problem)
    assert estimate.status is Status.OK
    assert estimate.used[problem.mask].all()
    np.testing.assert_array_equal(estimate.landmarks.index, problem.features)


@pytest.mark.slow
def test_raw_inertial_samples_and_tracks_correct_each_other(recordings: Recordings) -> None:
    sequence = data.read(
        recordings(f"utias/{UTIAS[-1]}.mat"),
        imu=recordings("imu/2011_09_30_drive_0027_imu0.csv"),
        imu_calibration=recordings("imu/oxts_sensor.yaml"),
    )
    problem = diagnosis.calibrated(sequence)
    error = {}
    for solve in (ekf.dead_reckoning, ekf.ekf, ekf.joint_ekf, ekf.joint_ekf_first_estimate):
        estimate = solve(problem)
        assert estimate.status is Status.OK
        assert estimate.state_covariance is not None
        assert_covariances(estimate.state_covariance[1:])
        error[estimate.name] = ate(estimate, problem.sequence)
    print(f"\nATE over 327 m: {error}")
    assert error["dead-reckoning"] > 30.0
    assert error["joint-ekf"] < 1.0
    assert error["joint-ekf-first-estimate"] < 1.0
    assert error["joint-ekf"] < error["ekf"] < error["dead-reckoning"]
