"""Axes and signs of gyroscope and accelerometer, by the rotations and accelerations that the cameras see.

The gyroscope has one of the 24 right-handed conventions, as velocities have. An accelerometer may also read with the
opposite sign, so that 48 are tried. In each, changes of the mean specific force from one window to the next are
compared with changes of the cameras' acceleration: gravity is constant in the world and cancels.
"""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS, IDENTITY, axes_matrix
from fgbaseline.data.finding import Finding
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, so3

from ..conventions.axes import Axes, angular_axes
from ..odometry.stereo_odometry import Odometry
from .units import mean_rates

MIN_INTERVALS = 20
WINDOW = 0.3
"""s, over which accelerations are averaged"""
MIN_WINDOWS = 12
MIN_CORRELATION, LEAD = 0.5, 0.3
"""of the best convention with the cameras, and beyond that of the axes as recorded"""
FARTHEST = 30.0
"""m/s^2, changes beyond which are wrong motions of the cameras"""


@dataclass(frozen=True, eq=False, slots=True)
class SensorAxes:
    """Conventions of both sensors; `x,y,z` as recorded."""

    gyroscope: Axes | None = None
    accelerometer: str = IDENTITY
    """right-handed, after the sign"""
    sign: float = 1.0
    """of the specific force: -1 where it reads -9.8 upward at rest"""
    correlation: tuple[float, float] = (np.nan, np.nan)
    """of the accelerometer with the cameras, as recorded and in this convention"""

    @property
    def accelerometer_matrix(self) -> FloatArray:
        """(3, 3) that takes recorded specific forces to the axes of imu_T_cam."""
        return self.sign * axes_matrix(self.accelerometer)

    @property
    def changed(self) -> bool:
        """Whether a sensor has other axes than imu_T_cam, or the opposite sign."""
        return bool(self.gyroscope is not None and self.gyroscope.changed) or self._force_changed

    @property
    def _force_changed(self) -> bool:
        return self.accelerometer != IDENTITY or self.sign != 1.0


def sensor_axes(sequence: Sequence, seen: Odometry) -> SensorAxes:
    """The conventions of a recording in SI units; as recorded where the cameras show too little."""
    if int(seen.known.sum()) < MIN_INTERVALS:
        return SensorAxes()
    gyroscope = angular_axes(seen.twist(sequence.dt)[:, 3:], mean_rates(sequence), seen.known)
    found = {
        (name, sign): _correlation(sequence, seen, sign * axes_matrix(name))
        for name in AXIS_CONVENTIONS
        for sign in (1.0, -1.0)
    }
    name, sign = max(found, key=lambda key: found[key])
    recorded, best = found[IDENTITY, 1.0], found[name, sign]
    if not (best > MIN_CORRELATION and best > recorded + LEAD):
        return SensorAxes(gyroscope, correlation=(recorded, recorded))
    return SensorAxes(gyroscope, name, sign, (recorded, best))


def _correlation(sequence: Sequence, seen: Odometry, matrix: FloatArray) -> float:
    """The correlation of both changes over all windows; -1 with too few of them."""
    assert sequence.imu is not None
    cut = imu_intervals(sequence.imu, sequence.t)
    dt = sequence.dt
    force = np.add.reduceat(cut.specific_force * cut.dt[:, None], cut.starts[:-1], axis=0) / dt[:, None] @ matrix.T
    known = seen.known
    step = np.where(known[:, None, None], seen.motion[:, :3, :3], np.eye(3))
    R = np.tile(np.eye(3), (len(dt), 1, 1))
    for k in range(len(dt) - 1):
        R[k + 1] = R[k] @ step[k]
    middle = R @ so3.exp_so3(0.5 * so3.log_so3(step))
    velocity = np.where(known[:, None], seen.motion[:, :3, 3] / dt[:, None], 0.0)
    in_world = [(middle @ values[:, :, None])[:, :, 0] for values in (velocity, force)]
    w = max(1, round(WINDOW / float(np.median(dt))))
    if len(dt) <= 2 * w + 1:
        return -1.0
    time = 0.5 * (sequence.t[1:] + sequence.t[:-1])
    acceleration = (in_world[0][w:] - in_world[0][:-w]) / (time[w:] - time[:-w])[:, None]
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(in_world[1], axis=0)])
    mean = (total[w + 1 :] - total[: -w - 1]) / (w + 1)
    missing = np.concatenate([[0], np.cumsum(~known)])
    whole = missing[2 * w + 1 :] == missing[: -2 * w - 1]
    by_cameras, by_samples = acceleration[w:] - acceleration[:-w], mean[w:] - mean[:-w]
    use = whole & (np.abs(by_cameras).max(axis=1) < FARTHEST)
    if int(use.sum()) < MIN_WINDOWS:
        return -1.0
    x, y = by_cameras[use], by_samples[use]
    size = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    return float(np.sum(x * y) / size) if size > 0.0 else -1.0


def in_imu_axes(sequence: Sequence, axes: SensorAxes) -> Sequence:
    """The recording with its samples in the axes of imu_T_cam."""
    imu = sequence.imu
    assert imu is not None
    if not axes.changed:
        return sequence
    rate = imu.angular_velocity if axes.gyroscope is None else imu.angular_velocity @ axes.gyroscope.matrix.T
    return replace(
        sequence,
        imu=replace(imu, angular_velocity=rate, specific_force=imu.specific_force @ axes.accelerometer_matrix.T),
    )


def axes_findings(axes: SensorAxes) -> tuple[Finding, ...]:
    """A finding for each sensor in other axes."""
    found = []
    gyroscope = axes.gyroscope
    if gyroscope is not None and gyroscope.changed:
        text = f"The gyroscope is recorded in other axes: the axes of imu_T_cam are its ({gyroscope.name})."
        said = f"leads the conventions that differ by {gyroscope.margin:.0f} in log-likelihood"
        found.append(Finding("angular_axes", text, gyroscope.before, gyroscope.after, "rad/s", said))
    if axes.accelerometer != IDENTITY or axes.sign != 1.0:
        sign = "with the opposite sign" if axes.sign < 0.0 else ""
        other = f"in other axes: those of imu_T_cam are its ({axes.accelerometer})"
        how = " and ".join(part for part in (sign, other if axes.accelerometer != IDENTITY else "") if part)
        text = f"The accelerometer is recorded {how}."
        said = "correlation with the accelerations that the cameras see"
        found.append(Finding("accelerometer_axes", text, *axes.correlation, "correlation", said))
    return tuple(found)
