"""The pipeline of a diagnosis of body velocities: units, observations, direction of the extrinsic, velocities."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.axis_conventions import IDENTITY
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import se3

from ..conventions.axes import ENOUGH
from ..conventions.extrinsics_check import doubt_of_position, extrinsic_unit, usual_rig
from ..conventions.units import Units, rescaled, units_of
from ..odometry.stereo_odometry import Odometry, odometry
from ..tracks.intrinsics_check import doubt_of_intrinsics
from ..tracks.recording_faults import unusable
from .result import Diagnosis
from .velocity_calibration import calibrate_velocities

TURNED = np.deg2rad(5.0)
"""rad, misalignment beyond that of a calibrated extrinsic"""
SURE = 16.0
"""squared standard errors of the misalignment by which one direction of the extrinsic must lead the other"""


def diagnose(
    sequence: Sequence,
    processes: int = 1,
    units: Mapping[str, float] | None = None,
    inverted: bool | None = None,
    *,
    replace_outliers: bool = True,
) -> Diagnosis:
    """Estimates units, axes, bias, scale, delay, misalignment and noise from the recording alone, without its truth.

    `processes` is the number of processes for the windows, forks of this one. `units` are known factors, by the names
    of `Units`; `inverted`, where known, whether imu_T_cam was recorded as its inverse. With `replace_outliers`,
    velocity samples that contradict the cameras and their neighbors are interpolated.
    """
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            return _diagnose(sequence, processes, units, inverted, replace_outliers)
    except (np.linalg.LinAlgError, ValueError, FloatingPointError) as error:
        return Diagnosis(sequence, f"its computation failed ({type(error).__name__}: {error})", recorded=sequence)


def known_units(sequence: Sequence, units: Mapping[str, float] | None = None) -> Units:
    """The units of a recording as `diagnose` estimates them; factors in `units` are known."""
    with threadpool_limits(limits=1, user_api="blas"):
        usual = usual_rig(sequence)
        return _units(sequence, usual, _seen(usual), units)


def _units(recorded: Sequence, usual: Sequence, seen: Odometry | None, given: Mapping[str, float] | None) -> Units:
    """Units of all values; that of the translation of imu_T_cam is last, as it needs the others."""
    doubt = doubt_of_intrinsics(recorded)
    units = Units(doubt=doubt) if doubt else units_of(recorded, seen, given)
    if units.doubt:
        return units
    found = (given or {}).get("extrinsic") or extrinsic_unit(rescaled(recorded, units), usual, seen, units.baseline)
    return replace(units, doubt=doubt_of_position(recorded)) if found is None else replace(units, extrinsic=found)


def _seen(sequence: Sequence) -> Odometry | None:
    return odometry(sequence) if len(sequence.observations) else None


def _diagnose(
    recorded: Sequence,
    processes: int,
    given: Mapping[str, float] | None,
    inverted: bool | None,
    replace_outliers: bool,
) -> Diagnosis:
    usual = usual_rig(recorded)
    seen_by_cameras = _seen(usual)
    units = _units(recorded, usual, seen_by_cameras, given)
    if units.doubt:
        return Diagnosis(recorded, units.doubt, units=units, recorded=recorded)
    sequence = rescaled(recorded, units)
    reason = unusable(sequence)
    if reason or seen_by_cameras is None:
        return Diagnosis(sequence, reason, units=units, recorded=recorded)
    if sequence.camera != usual.camera or not np.array_equal(sequence.imu_T_cam, usual.imu_T_cam):
        seen_by_cameras = odometry(sequence)
    found = calibrate_velocities(sequence, seen_by_cameras, processes, replace_outliers=replace_outliers)
    if inverted or (inverted is None and _may_be_inverse(found)):
        turned = replace(sequence, imu_T_cam=se3.inverse(sequence.imu_T_cam))
        inverse = calibrate_velocities(turned, odometry(turned), processes, replace_outliers=replace_outliers)
        if inverted or _leads(inverse, found):
            found = replace(inverse, inversion=(found.angular.before, inverse.angular.after))
    return replace(found, units=units, recorded=recorded)


def _may_be_inverse(given: Diagnosis) -> bool:
    """Whether an inverse could be the cause: both velocities in other axes, or an extrinsic that is far off."""
    axes = given.angular.changed and given.linear.changed
    return given.fit is not None and (axes or float(np.linalg.norm(given.misalignment[0])) > TURNED)


def _leads(inverse: Diagnosis, given: Diagnosis) -> bool:
    """Whether the inverse extrinsic explains the recording better than other axes of both velocities do.

    By their likelihoods alone the two explanations may be nearly equal; then the smaller misalignment decides.
    """
    if inverse.fit is None or inverse.angular.changed or inverse.linear.changed:
        return False
    lead = sum(
        ours.scores[IDENTITY] - theirs.scores[theirs.name]
        for ours, theirs in ((inverse.angular, given.angular), (inverse.linear, given.linear))
    )
    angles = [float(np.sum((d.misalignment[0] / d.misalignment[1]) ** 2)) for d in (inverse, given)]
    return bool(lead > ENOUGH or (lead > -ENOUGH and angles[0] + SURE < angles[1]))
