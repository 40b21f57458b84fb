"""Gyroscope and accelerometer against the cameras: bias, extrinsic rotation, time offset, scale, gravity, range."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, so3

from ..conventions.robust_regression import regress
from ..inertial_initialization.inertial_path import InertialPath
from ..inertial_initialization.initial_state import Start
from ..odometry.stereo_odometry import Odometry
from .stationary_noise import RestNoise, rest_noise
from .units import mean_rates

MIN_INTERVALS = 20
PRIOR = np.array([0.2] * 3 + [0.2] * 3 + [0.1, 0.1])
"""rad/s, rad, s and share: sigmas of a prior, wide compared with what a recording determines"""
CORRELATED = 2.0
"""factor on standard errors, since errors of neighboring intervals are correlated"""
SYSTEMATIC = 0.02
"""px, error between frames that all tracks share: trackers shorten motions of tenths of a pixel"""
SATURATED = 5
"""successive samples at the largest value of a component that count as saturation"""
SATURATED_TIMES = 2
"""smallest number of such series"""


@dataclass(frozen=True, eq=False, slots=True)
class SensorChecks:
    """Errors of the sensors against visual odometry; the second entry of a pair is its standard error."""

    gyroscope_bias: tuple[FloatArray, FloatArray]
    """(3,) rad/s in the axes of imu_T_cam"""
    misalignment: tuple[FloatArray, FloatArray]
    """(3,) rad, rotation vector by which imu_T_cam is turned against the gyroscope"""
    time_offset: tuple[float, float]
    """s, positive if the stamps of the samples are too late"""
    gyroscope_scale: tuple[float, float]
    """recorded angular velocity over that of the cameras"""
    rate_error: tuple[float, float]
    """rad/s, median against the cameras: as recorded, and without bias, misalignment and offset"""
    accelerometer_bias: FloatArray | None
    """(3,) m/s^2, of the path at its middle; None with one camera, whose recording has no path of its own"""
    gravity: tuple[float, float] | None
    """m/s^2, as measured along the vertical of the path, and as given"""
    saturated: tuple[tuple[str, float, int], ...]
    """component, its value at the end of the range, and the number of samples there"""
    rest: RestNoise | None
    """noise measured during a standing start; None without one"""

    @property
    def determined(self) -> bool:
        """Whether the cameras know the motion of enough intervals."""
        return bool(np.isfinite(self.time_offset[1]))


def sensor_checks(
    sequence: Sequence, seen: Odometry, path: InertialPath | None = None, start: Start | None = None
) -> SensorChecks:
    """Checks of both sensors of a recording in SI units, along its path if there is one."""
    assert sequence.imu is not None
    known = seen.known
    rate, dt = mean_rates(sequence), sequence.dt
    bias, turn, offset, scale = _nothing(3), _nothing(3), (0.0, np.inf), (1.0, np.inf)
    before = after = np.nan
    if int(known.sum()) >= MIN_INTERVALS:
        turned = seen.twist(dt)[known, 3:]
        y = rate[known] - turned
        slope = np.diff(_rates_at_frames(sequence), axis=0)[known] / dt[known, None]
        w = rate[known] - np.median(y, axis=0)  # without the bias, which scale and misalignment do not act on
        ones = np.tile(np.eye(3), (len(y), 1, 1))
        # Noise of the gyroscope shows in y as a scale of what it reads, noise of the cameras as the opposite scale of
        # what they see. The truth is between both, which are far apart where the noise is all that moves.
        designs = [
            np.concatenate([ones, so3.hat3(w), -slope[:, :, None], scaled[:, :, None]], axis=2)
            for scaled in (w, turned)
        ]
        fits = [regress(y, design, PRIOR) for design in designs]
        theta = np.mean([fit.theta for fit in fits], axis=0)
        formal = CORRELATED * np.sqrt(np.diag(fits[0].covariance))
        between = 0.5 * (fits[0].theta - fits[1].theta)
        moved = sequence.camera.fu * dt[known, None] * np.linalg.norm(designs[0], axis=1)
        deviation = np.sqrt(formal**2 + between**2 + SYSTEMATIC**2 / np.mean(moved**2, axis=0))
        bias, turn = (theta[:3], deviation[:3]), (theta[3:6], deviation[3:6])
        offset = float(theta[6]), float(deviation[6])
        scale = 1.0 + float(theta[7]), float(deviation[7])
        before = float(np.median(np.linalg.norm(y, axis=1)))
        after = float(np.median(np.linalg.norm(y - designs[0] @ theta, axis=1)))
    middle = None if path is None else path.states.accelerometer_bias[len(path.states) // 2]
    gravity = None if path is None else _gravity(sequence, path)
    rest = None if start is None or not start.standing else rest_noise(sequence, start.standing)
    return SensorChecks(bias, turn, offset, scale, (before, after), middle, gravity, tuple(_saturated(sequence)), rest)


def _nothing(n: int) -> tuple[FloatArray, FloatArray]:
    return np.zeros(n), np.full(n, np.inf)


def _rates_at_frames(sequence: Sequence) -> FloatArray:
    """Angular velocities (T, 3) at the frames, rad/s."""
    imu = sequence.imu
    assert imu is not None
    return np.stack([np.interp(sequence.t, imu.t, column) for column in imu.angular_velocity.T], axis=1)


def _gravity(sequence: Sequence, path: InertialPath) -> tuple[float, float]:
    """Gravity as measured along the vertical, and as given.

    The path holds gravity to its given magnitude, so that an excess shows in the bias along the vertical.
    """
    imu = sequence.imu
    assert imu is not None
    vertical = path.states.pose[:, 2, :3]
    excess = np.einsum("ni,ni->n", vertical, path.states.accelerometer_bias)
    return imu.gravity + float(excess.mean()), imu.gravity


def _saturated(sequence: Sequence) -> list[tuple[str, float, int]]:
    """Components that stay at one largest value for several samples, as a sensor at the end of its range does."""
    imu = sequence.imu
    assert imu is not None
    found = []
    for name, values in (("angular velocity", imu.angular_velocity), ("specific force", imu.specific_force)):
        for axis, column in zip("xyz", values.T, strict=True):
            for limit in (float(column.max()), float(column.min())):
                at = np.concatenate([[False], column == limit, [False]])
                edges = np.flatnonzero(np.diff(at.astype(np.int8)))
                long = (edges[1::2] - edges[::2]) >= SATURATED
                if int(long.sum()) >= SATURATED_TIMES and abs(limit) > 0.0 and float(np.ptp(column)) > 0.0:
                    found.append((f"{name} {axis}", limit, int((column == limit).sum())))
    return found
