"""Unit of the rig's lengths, of the stereo baseline by the accelerations that cameras and accelerometer show.

An implausible baseline is right, or in the unit that makes it plausible: the cameras' accelerations are those of the
accelerometer with one of the two.
"""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.sequence import Sequence

from ..conventions.extrinsics_check import FARTHEST_CAMERA, camera_distance, doubt_of_position, is_far, usual_rig
from ..conventions.units import TOLERANCE, Units, unit_findings
from ..odometry.stereo_odometry import Odometry
from .accelerations import MIN_CORRELATION, acceleration_changes


@dataclass(frozen=True, slots=True)
class BaselineUnit:
    """Factor that converts the baseline to m; `doubt` states why it is not known."""

    factor: float = 1.0
    extrinsic: float = 1.0
    """converts the translation of imu_T_cam to m"""
    ratio: float = np.nan
    """RMS of the changes of acceleration, accelerometer over cameras with the baseline as recorded"""
    doubt: str = ""


def baseline_unit(sequence: Sequence, seen: Odometry | None) -> BaselineUnit:
    """The unit of the lengths of a recording whose samples are in SI units and in the axes of imu_T_cam.

    `seen` is the odometry of `usual_rig(sequence)`. A camera that is far from the IMU has the unit of the baseline.
    """
    found = _by_accelerations(sequence, seen)
    if found.doubt or not is_far(sequence):
        return found
    if camera_distance(sequence) * found.factor <= FARTHEST_CAMERA:
        return replace(found, extrinsic=found.factor)
    return replace(found, doubt=doubt_of_position(sequence))


def _by_accelerations(sequence: Sequence, seen: Odometry | None) -> BaselineUnit:
    b = sequence.stereo_camera.baseline
    usual = usual_rig(sequence).stereo_camera.baseline / b
    if usual == 1.0 or seen is None:
        return BaselineUnit()
    for factor in (1.0, usual):
        changes = acceleration_changes(sequence, seen, factor / usual)
        if changes is None or not changes.correlation(np.eye(3)) > MIN_CORRELATION:
            continue
        x, y = changes.by_cameras, changes.of_force(np.eye(3))
        ratio = float(np.sqrt(np.mean(y**2) / np.mean(x**2)))
        if abs(np.log10(ratio)) < TOLERANCE:
            return BaselineUnit(factor, ratio=ratio * factor)
    return BaselineUnit(
        doubt=f"the stereo baseline, {b:.6g} m, is in doubt: the accelerometer shows neither the accelerations that "
        f"the cameras see with it nor those with {b * usual:.6g} m; write b in m"
    )


def baseline_findings(unit: BaselineUnit, recorded: Sequence) -> tuple[Finding, ...]:
    """A finding for each of baseline and translation of imu_T_cam that is not in m."""
    seen = f"the accelerometer shows changes of acceleration {unit.ratio:.3g} times those that the cameras see"
    return unit_findings(Units(baseline=unit.factor, extrinsic=unit.extrinsic), recorded, seen)
