"""Axes and signs of gyroscope and accelerometer, by the rotations and accelerations that the cameras see.

The gyroscope has one of the 24 right-handed conventions, as velocities have. An accelerometer may also read with the
opposite sign, so that 48 are tried: the one whose changes of acceleration are most like those of the cameras.
"""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS, IDENTITY, axes_matrix
from fgbaseline.data.finding import Finding
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import number
from fgbaseline.geometry import FloatArray

from ..conventions.axes import Axes, angular_axes
from ..odometry.stereo_odometry import Odometry
from .accelerations import MIN_CORRELATION, acceleration_changes
from .units import mean_rates

MIN_INTERVALS = 20
LEAD = 0.3
"""lead of the best convention's correlation with the cameras over that of the axes as recorded"""


@dataclass(frozen=True, eq=False, slots=True)
class SensorAxes:
    """Conventions of both sensors; `x,y,z` as recorded."""

    gyroscope: Axes | None = None
    accelerometer: str = IDENTITY
    """right-handed, after the sign"""
    sign: float = 1.0
    """sign of the specific force: -1 where it reads -9.8 upward at rest"""
    correlation: tuple[float, float] = (np.nan, np.nan)
    """correlation of the accelerometer with the cameras, as recorded and in this convention"""
    misfit: tuple[float, float] | None = None
    """px, with one camera: residual of the tracks along the closed-form motion, as recorded and in this convention"""

    @property
    def accelerometer_matrix(self) -> FloatArray:
        """Matrix (3, 3) from recorded specific forces to the axes of imu_T_cam, the sign included."""
        return self.sign * axes_matrix(self.accelerometer)

    @property
    def changed(self) -> bool:
        """Whether a sensor has other axes than imu_T_cam, or the opposite sign."""
        return bool(self.gyroscope is not None and self.gyroscope.changed) or self.force_changed

    @property
    def force_changed(self) -> bool:
        """Whether the accelerometer has other axes than imu_T_cam, or the opposite sign."""
        return self.accelerometer != IDENTITY or self.sign != 1.0


def sensor_axes(sequence: Sequence, seen: Odometry) -> SensorAxes:
    """The conventions of a recording in SI units; as recorded where the cameras show too little."""
    if int(seen.known.sum()) < MIN_INTERVALS:
        return SensorAxes()
    gyroscope = angular_axes(seen.twist(sequence.dt)[:, 3:], mean_rates(sequence), seen.known)
    changes = acceleration_changes(sequence, seen)
    if changes is None:
        return SensorAxes(gyroscope)
    found = {
        (name, sign): changes.correlation(sign * axes_matrix(name)) for name in AXIS_CONVENTIONS for sign in (1.0, -1.0)
    }
    name, sign = max(found, key=lambda key: found[key])
    recorded, best = found[IDENTITY, 1.0], found[name, sign]
    if not (best > MIN_CORRELATION and best > recorded + LEAD):
        return SensorAxes(gyroscope, correlation=(recorded, recorded))
    return SensorAxes(gyroscope, name, sign, (recorded, best))


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
        certainty = f"log-likelihood {number(round(gyroscope.margin))} above the next convention"
        found.append(Finding("angular_axes", text, gyroscope.before, gyroscope.after, "rad/s", certainty))
    if axes.force_changed:
        sign = "with the opposite sign" if axes.sign < 0.0 else ""
        other = f"in other axes: those of imu_T_cam are its ({axes.accelerometer})"
        how = " and ".join(part for part in (sign, other if axes.accelerometer != IDENTITY else "") if part)
        text = f"The accelerometer is recorded {how}."
        certainty = "correlation with the accelerations that the cameras see"
        figures, unit = axes.correlation, "correlation"
        if axes.misfit is not None:
            certainty = "residual of tracks along the motion in closed form"
            figures, unit = axes.misfit, "px"
        found.append(Finding("accelerometer_axes", text, *figures, unit, certainty))
    return tuple(found)
