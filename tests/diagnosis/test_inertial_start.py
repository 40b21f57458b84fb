"""The start of an inertial problem: right within its covariance at rest, at speed, in a turn and upside down."""

import numpy as np
import pytest
from scipy.stats import chi2

from fgbaseline.data import Sequence
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.diagnosis.inertial_initialization.initial_state import Start, inertial_start
from fgbaseline.diagnosis.odometry.stereo_odometry import odometry
from fgbaseline.geometry import FloatArray, so3, strapdown

from ..builders.inertial_paths import PIXEL, Path, at_rest, inertial_recording, straight, turn, upside_down

PATHS = (at_rest, straight, turn, upside_down)
FREE = 11
"""position and heading define the world"""


def started(sequence: Sequence) -> Start:
    assert sequence.imu is not None
    start = inertial_start(sequence, odometry(sequence), imu_intervals(sequence.imu, sequence.t), PIXEL)
    assert start is not None
    return start


def error_of(start: Start, sequence: Sequence) -> FloatArray:
    """(15,) the true state less the start, in the start's world: turned about z so that the headings agree."""
    truth = sequence.truth
    assert truth is not None
    assert truth.velocity is not None
    assert truth.gyroscope_bias is not None
    assert truth.accelerometer_bias is not None
    true, R = truth.world_T_imu[0, :3, :3], start.pose[:3, :3]
    M = true @ R.T
    yaw = so3.exp_so3(np.array([0.0, 0.0, np.arctan2(M[0, 1] - M[1, 0], M[0, 0] + M[1, 1])]))
    return np.concatenate(
        [
            np.zeros(3),
            so3.log_so3(R.T @ yaw @ true),
            yaw @ truth.velocity[0] - start.state.velocity,
            truth.gyroscope_bias[0] - start.state.gyroscope_bias,
            truth.accelerometer_bias[0] - start.state.accelerometer_bias,
        ]
    )


def nees(start: Start, sequence: Sequence) -> float:
    """Squared error in units of the covariance, of 11 degrees of freedom."""
    e, up = error_of(start, sequence), start.pose[2, :3]
    basis = np.zeros((strapdown.STATE, FREE))
    basis[strapdown.ROTATION, :2] = np.linalg.svd(up[None])[2][1:].T
    basis[6:, 2:] = np.eye(9)
    free = basis.T @ e
    return float(free @ np.linalg.solve(basis.T @ start.state.covariance @ basis, free))


@pytest.mark.parametrize("path", PATHS)
def test_a_start_is_near_the_truth(path: Path) -> None:
    sequence = inertial_recording(path, seed=3)
    start = started(sequence)
    e = error_of(start, sequence)
    assert np.linalg.norm(e[strapdown.ROTATION]) < np.deg2rad(5.0)  # a bias of 0.2 m/s^2 is as good as 1.2 degrees
    assert np.linalg.norm(e[strapdown.VELOCITY]) < 0.25  # at 25 m/s along a straight its RMS over seeds is 0.4
    assert np.linalg.norm(e[strapdown.GYROSCOPE_BIAS]) < 0.01
    assert bool(start.standing) == (path is at_rest)


@pytest.mark.parametrize("path", PATHS)
def test_its_pose_is_the_smallest_rotation_that_is_level(path: Path) -> None:
    start = started(inertial_recording(path))
    R = start.pose[:3, :3]
    np.testing.assert_allclose(R, so3.rotation_to_z(R[2]), atol=1e-12)
    np.testing.assert_array_equal(start.pose[:3, 3], 0.0)
    assert (R[2, 2] < 0.0) == (path is upside_down)


@pytest.mark.parametrize("path", PATHS)
def test_position_and_heading_have_no_variance(path: Path) -> None:
    start = started(inertial_recording(path))
    covariance = start.state.covariance
    np.testing.assert_allclose(covariance[:3], 0.0, atol=1e-15)
    np.testing.assert_allclose(covariance[3:6, 3:6] @ start.pose[2, :3], 0.0, atol=1e-12)
    assert np.linalg.eigvalsh(covariance)[4:].min() > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("path", PATHS)
def test_the_covariance_is_consistent_over_50_seeds(path: Path) -> None:
    """The mean NEES lies within its 99.9 % interval."""
    values = [nees(started(sequence), sequence) for sequence in (inertial_recording(path, s, 12) for s in range(50))]
    low, high = chi2.ppf([0.0005, 0.9995], 50 * FREE) / 50
    assert low < np.mean(values) < high


def test_vibration_does_not_hide_a_standing_start() -> None:
    """The samples alone scatter by 0.06 rad/s; the cameras see no motion."""
    sequence = inertial_recording(at_rest, n_frames=40)
    assert sequence.imu is not None
    assert sequence.imu.angular_velocity.std(axis=0).min() > 0.05
    start = started(sequence)
    assert start.standing == pytest.approx(3.0, abs=0.11)
    assert "standing start" in start.state.source


def test_a_start_without_tracks_is_none() -> None:
    sequence = inertial_recording(straight)
    o = sequence.observations
    blind = sequence.__class__(
        sequence.name,
        sequence.t,
        sequence.linear_velocity,
        sequence.angular_velocity,
        sequence.camera,
        sequence.imu_T_cam,
        o.select(o.frame > 10),
        sequence.n_landmarks,
        imu=sequence.imu,
    )
    assert blind.imu is not None
    assert inertial_start(blind, odometry(blind), imu_intervals(blind.imu, blind.t), PIXEL) is None
