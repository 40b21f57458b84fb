"""Calibration of the recorded velocities against stereo odometry: axes, delay, bias, scale, misalignment and noise."""

import numpy as np

from fgbaseline.data.axis_conventions import twist_in_imu_axes
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.velocity_increments import Shift, zero_order_hold
from fgbaseline.geometry import FloatArray

from ..conventions.axes import Axes, angular_axes, linear_axes
from ..conventions.integer_time_offset import integer_time_offset
from ..conventions.velocity_time_offset import timing
from ..noise.calibration_fit import fit_windows, half_cost
from ..odometry.stereo_odometry import Odometry
from ..tracks.track_segments import repeated
from .result import Diagnosis
from .velocity_outliers import VelocityOutliers, velocity_outliers

MIN_INTERVALS = 20
"""number of intervals with a motion from odometry"""
SURE_SHIFT = 2.0
"""standard errors from a usual shift, beyond which another one is used; STANDARD_ERROR_FACTOR is in them already"""
SNAP = 0.15
"""intervals, distance from a usual shift (`Shift`) below which that one is used"""


def calibrate_velocities(
    sequence: Sequence, seen_by_cameras: Odometry, processes: int, *, replace_outliers: bool = True
) -> Diagnosis:
    """The calibration of the velocities of a recording in SI units against its stereo odometry.

    With `replace_outliers`, samples that contradict the cameras and their neighbors are interpolated.
    """
    copies = repeated(sequence)
    known = seen_by_cameras.known
    if known.sum() < MIN_INTERVALS:
        reason = f"the cameras determine the motion of only {int(known.sum())} of {len(known)} intervals"
        return Diagnosis(sequence, reason, seen_by_cameras, repeated=copies)
    angular, linear = _axes_of(sequence, seen_by_cameras)
    outliers = None
    if replace_outliers:
        outliers = velocity_outliers(sequence, seen_by_cameras, linear.matrix, angular.matrix)
    if outliers is not None:
        sequence = outliers.replaced(sequence)
        angular, linear = _axes_of(sequence, seen_by_cameras)
    return calibrate_with_axes(
        sequence, seen_by_cameras, angular, linear, copies, processes=processes, outliers=outliers
    )


def _axes_of(sequence: Sequence, seen_by_cameras: Odometry) -> tuple[Axes, Axes]:
    """The axis conventions of angular and linear velocity."""
    seen, recorded, known = (
        seen_by_cameras.twist(sequence.dt),
        zero_order_hold(sequence, Shift.MIDDLE),
        seen_by_cameras.known,
    )
    angular = angular_axes(seen[:, 3:], recorded[:, 3:], known)
    return angular, linear_axes(
        seen[:, :3], recorded[:, :3], seen[:, 3:], known, angular.name, sequence.stereo_camera.baseline
    )


def calibrate_with_axes(
    sequence: Sequence,
    seen_by_cameras: Odometry,
    angular: Axes,
    linear: Axes,
    copies: BoolArray,
    given_shift: float | None = None,
    processes: int = 1,
    outliers: VelocityOutliers | None = None,
) -> Diagnosis:
    """Delay (unless `given_shift`), bias, scale, misalignment and noise of velocities in given axes.

    `outliers` are those that are replaced in the sequence.
    """
    seen, known = seen_by_cameras.twist(sequence.dt), seen_by_cameras.known
    dt = float(np.median(sequence.dt))
    when = timing(seen[:, 3:], sequence.angular_velocity[:-1] @ angular.matrix.T, known, dt)

    def twist(shift: float) -> FloatArray:
        return twist_in_imu_axes(zero_order_hold(sequence, shift), linear.name, angular.name)

    def deviation(shift: float) -> FloatArray | None:
        return None if outliers is None else outliers.of_intervals(shift, linear.matrix, angular.matrix)

    fit = None
    if not when.identifiable and given_shift is None:
        fit = fit_windows(sequence, seen_by_cameras, twist(Shift.AFTER), processes, deviation(Shift.AFTER))
        white = None if fit is None else fit.white
        if white is not None:

            def cost(shift: float) -> float:
                return half_cost(sequence, seen_by_cameras, twist(shift), white, processes, deviation(shift))

            when = integer_time_offset(cost, dt) or when
    found = _usual(when.shift / dt, when.deviation / dt) if when.identifiable else float(Shift.AFTER)
    shift = found if given_shift is None else given_shift
    if fit is None or shift != Shift.AFTER:
        fit = fit_windows(sequence, seen_by_cameras, twist(shift), processes, deviation(shift))
    reason = "" if fit is not None else "no stretch of the recording has enough tracks to separate noise from error"
    return Diagnosis(sequence, reason, seen_by_cameras, angular, linear, when, shift, fit, copies, outliers=outliers)


def _usual(shift: float, deviation: float) -> float:
    """The usual shift that is near, or within the error; else the shift itself. All in intervals."""
    nearest = min(Shift, key=lambda usual: abs(shift - usual))
    if abs(shift - nearest) < SNAP:
        return float(nearest)
    return next((float(usual) for usual in Shift if abs(shift - usual) <= SURE_SHIFT * deviation), shift)
