"""Plausible stereo rigs, and the unit of the translation of imu_T_cam.

On a turn the camera moves by its lever arm p: v_camera = v_imu + w x p. The unit is the one in which this explains the
camera's velocity that odometry measures.
"""

from dataclasses import replace

import numpy as np

from fgbaseline.data.sequence import Sequence
from fgbaseline.data.velocity_increments import zero_order_hold

from ..odometry.stereo_odometry import Odometry
from .robust_regression import regress

BASELINES = (0.01, 5.0)
"""m, of stereo rigs"""
FARTHEST_CAMERA = 20.0
"""m from the IMU"""
UNITS_OF_LENGTH = (1e-3, 1e-2)
"""m: of mm and cm"""
SHORT = 3.0
"""m, of a lever arm that is usual in m, and not in mm"""
SURE = 4.0
"""standard errors"""
MIN_INTERVALS = 20
LARGEST = 10.0
"""prior deviation of the factor"""


def usual_rig(sequence: Sequence) -> Sequence:
    """The recording with an implausible baseline scaled to a plausible one, for odometry, which works at any scale.

    The camera is placed at the IMU where the unit of its position is unknown: with such a baseline, and far away.
    """
    b = sequence.stereo_camera.baseline
    usual = BASELINES[0] <= b <= BASELINES[1]
    if usual and not is_far(sequence):
        return sequence
    factor = 1.0 if usual else 1000.0 ** -round(np.log(b / 0.2) / np.log(1000.0))
    imu_T_cam = sequence.imu_T_cam.copy()
    imu_T_cam[:3, 3] = 0.0
    return replace(sequence, camera=replace(sequence.stereo_camera, baseline=b * factor), imu_T_cam=imu_T_cam)


def camera_distance(sequence: Sequence) -> float:
    """Distance of the left camera from the IMU by imu_T_cam, m."""
    return float(np.linalg.norm(sequence.imu_T_cam[:3, 3]))


def is_far(sequence: Sequence) -> bool:
    """Whether imu_T_cam places the camera further from the IMU than on any vehicle."""
    return camera_distance(sequence) > FARTHEST_CAMERA


def doubt_of_position(sequence: Sequence) -> str:
    """Doubt about a camera that is far from the IMU, in words."""
    return (
        f"imu_T_cam places the camera {camera_distance(sequence):.4g} m from the IMU, and nothing confirms that; "
        "write its translation in m"
    )


def unconfirmed_position(sequence: Sequence) -> str:
    """Doubt about the position of the camera, where no motion in meters confirms it; empty for a near camera."""
    return doubt_of_position(sequence) if is_far(sequence) else ""


def extrinsic_unit(sequence: Sequence, usual: Sequence, seen: Odometry | None, of_baseline: float) -> float | None:
    """Factor that converts the translation of imu_T_cam to m, None where it is not m and the motion does not show it.

    All else of `sequence` is in SI units, `usual` is its rig as recorded that `seen` was computed with. A recorded
    baseline that was in `of_baseline` m makes the same unit of the translation the first choice.
    """
    length = camera_distance(sequence)
    if length < SHORT:
        return 1.0
    others = [f for f in dict.fromkeys((of_baseline, *UNITS_OF_LENGTH)) if f < 1.0 and length * f <= FARTHEST_CAMERA]
    seen_factor, error = _factor(sequence, usual, seen)
    fitting = [f for f in (1.0, *others) if abs(seen_factor - f) <= max(SURE * error, f / 2.0)]
    if fitting and (fitting[0] < 1.0 or SURE * error < 1.0):
        return fitting[0]
    if not is_far(sequence):
        return 1.0
    return of_baseline if of_baseline in others else None


def _factor(sequence: Sequence, usual: Sequence, seen: Odometry | None) -> tuple[float, float]:
    """Factor of the lever arm by which the camera's velocity differs from that of the IMU, and its standard error."""
    if seen is None or int(seen.known.sum()) < MIN_INTERVALS:
        return 1.0, np.inf
    known = seen.known
    linear, angular = np.split(seen.twist(sequence.dt)[known], 2, axis=1)
    scale = sequence.stereo_camera.baseline / usual.stereo_camera.baseline
    camera = (linear + np.cross(angular, usual.imu_T_cam[:3, 3])) * scale
    turning = np.cross(angular, sequence.imu_T_cam[:3, 3])
    found = regress(camera - zero_order_hold(sequence)[known, :3], turning[:, :, None], np.array([LARGEST]))
    return float(found.theta[0]), float(np.sqrt(found.covariance[0, 0]))
