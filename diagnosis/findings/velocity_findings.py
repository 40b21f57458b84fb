"""Findings on units, velocities and calibration, and parameters that are not identifiable, in sentences."""

from collections.abc import Callable

import numpy as np

from fgbaseline.data.axis_conventions import IDENTITY, axes_matrix, twist_in_imu_axes
from fgbaseline.data.finding import Finding
from fgbaseline.data.velocity_increments import Shift, zero_order_hold
from fgbaseline.data.wording import listed, noun, number, per_cent, plural, signed, vector
from fgbaseline.geometry import FloatArray

from ..body_velocity.result import Diagnosis
from ..conventions.axes import Axes
from ..conventions.units import LABELS, unit_findings
from ..noise.calibration_fit import SIGNIFICANT
from ..repairs.significance import significant_bias, significant_misalignment, significant_offset
from ..tracks.intrinsics_check import intrinsics_findings
from .frame_spans import spans
from .track_findings import track_findings
from .track_statistics import TrackStatistics, track_statistics

MIN_SCALE = 0.02
"""relative difference of velocity and stereo scales from which on it is a finding"""
MIN_GYRO_SCALE = 0.25
"""relative difference of recorded and visual angular velocities, beyond their noise, that is a finding"""
USUAL = (float(Shift.AFTER), float(Shift.MIDDLE))
"""intervals; shifts that are a convention and no fault"""
KNOWN_BIAS, KNOWN_SCALE, KNOWN_ANGLE = 0.002, 0.02, np.deg2rad(0.5)
"""rad/s, share and rad: standard errors beyond which a value is not identifiable"""


def findings_of(diagnosis: Diagnosis, tracks: TrackStatistics | None = None) -> tuple[Finding, ...]:
    """Significant faults, velocities first; none for a clean recording. `tracks` is `track_statistics(diagnosis)`."""
    findings: list[Finding] = [*diagnosis.sequence.findings, *intrinsics_findings(diagnosis.sequence)]
    if diagnosis.recorded is not None:
        findings += unit_findings(diagnosis.units, diagnosis.recorded)
    if diagnosis.inversion is not None:
        findings.append(_extrinsic_inverse(*diagnosis.inversion))
    findings += _outliers(diagnosis)
    if diagnosis.fit is not None:
        parts: tuple[Callable[[Diagnosis], Finding | None], ...] = (
            _angular_axes,
            _linear_axes,
            _gyro_bias,
            _time_offset,
            _gyro_scale,
            _velocity_scale,
            _extrinsic,
            _disparity_offset,
        )
        findings += [finding for part in parts if (finding := part(diagnosis)) is not None]
    return (*findings, *track_findings(diagnosis.sequence, diagnosis.repeated, tracks or track_statistics(diagnosis)))


def _outliers(diagnosis: Diagnosis) -> list[Finding]:
    """A finding for each velocity with replaced samples."""
    outliers, found = diagnosis.outliers, []
    if outliers is None:
        return []
    kinds = (("linear", outliers.linear, "m/s"), ("angular", outliers.angular, "rad/s"))
    for (name, mask, unit), size in zip(kinds, outliers.size, strict=True):
        frames = np.flatnonzero(mask)
        if len(frames) == 0:
            continue
        count = plural(len(frames), f"{name} velocity", f"{name} velocities")
        text = (
            f"{count} of {len(mask):,} contradict{'s' if len(frames) == 1 else ''} the cameras and the samples around "
            f"({noun(len(frames), 'frame')} {spans(frames)}, by up to {size:.3g} {unit}): replaced by an interpolation "
            "of the samples around."
        )
        found.append(Finding(f"{name}_velocity_outliers", text, len(frames), 0, "samples", "counted"))
    return found


def rescalings(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Conversions of units and an inverted extrinsic, which precede all else; one sentence each."""
    done = [f"{LABELS[name]} multiplied by {f:.6g}" for name in LABELS if (f := getattr(diagnosis.units, name)) != 1.0]
    return (*done, *(["extrinsic imu_T_cam inverted"] if diagnosis.inverted else []))


def _extrinsic_inverse(before: float, after: float) -> Finding:
    return Finding(
        "extrinsic_inverse",
        "imu_T_cam is recorded as its inverse, cam_T_imu: inverted, it fits the turns and distances that the cameras "
        "see in the axes of both velocities, and as recorded in neither. It is inverted.",
        before,
        after,
        "rad/s",
        "compared by the odometry of the cameras",
    )


def not_identifiable(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Parameters that the recording does not determine, one sentence each."""
    if diagnosis.failure_reason:
        return (f"Nothing about the velocities: {diagnosis.failure_reason}.",)
    sentences = [_unseen("linear velocity", diagnosis.linear), _unseen("angular velocity", diagnosis.angular)]
    if not diagnosis.timing.identifiable:
        sentences.append("A time offset between velocities and images: this needs rotation that both measure.")
    deviation = diagnosis.gyro_bias_deviation
    if (deviation > KNOWN_BIAS).any():
        sentences.append(f"The gyroscope's bias better than to {vector(deviation, 4)} rad/s (standard errors).")
    if diagnosis.velocity_scale[1] > KNOWN_SCALE:
        sentences.append(f"The scale of the velocities better than to {per_cent(diagnosis.velocity_scale[1])}.")
    angle = diagnosis.misalignment[1]
    loose = ["xyz"[i] for i in range(3) if angle[i] > KNOWN_ANGLE]
    if loose:
        worst = np.rad2deg(angle.max())
        sentences.append(
            f"The rotation of imu_T_cam about {listed(loose)}: its standard error is {worst:.1f}°, above the limit of "
            f"{np.rad2deg(KNOWN_ANGLE):.1f}°."
        )
    return tuple(sentence for sentence in sentences if sentence)


def rate_error(diagnosis: Diagnosis, shift: float, bias: FloatArray, convention: str) -> float:
    """Median error in rad/s of the angular velocity against odometry, with this shift, bias and convention."""
    assert diagnosis.odometry is not None
    known = diagnosis.odometry.known
    recorded = zero_order_hold(diagnosis.sequence, shift)
    recorded[:, 3:] -= bias
    difference = twist_in_imu_axes(recorded, IDENTITY, convention) - diagnosis.odometry.twist(diagnosis.sequence.dt)
    return float(np.median(np.linalg.norm(difference[known, 3:], axis=1)))


def _angular_axes(diagnosis: Diagnosis) -> Finding | None:
    return _axes("angular", diagnosis.angular, "rad/s") if diagnosis.angular.changed else None


def _linear_axes(diagnosis: Diagnosis) -> Finding | None:
    return _axes("linear", diagnosis.linear, "m/s") if diagnosis.linear.changed else None


def _axes(which: str, axes: Axes, unit: str) -> Finding:
    """Finding of changed axes, which names sign changes where these are all."""
    matrix = axes_matrix(axes.name)
    reversed_ = ["xyz"[i] for i in range(3) if matrix[i, i] < 0]
    letter = "w" if which == "angular" else "v"
    if np.abs(np.diag(matrix)).all():
        what = f"Components {listed(f'{letter}_{axis}' for axis in reversed_)} are recorded with the opposite sign"
    else:
        what = f"The {which} velocity is recorded in other axes: the IMU axes of imu_T_cam are its ({axes.name})"
    unseen = [name for name, seen in zip("xyz", axes.determined, strict=True) if not seen]
    part = f"; that of {listed(unseen)} is a guess, the cameras do not determine it" if unseen else ""
    return Finding(
        f"{which}_axes",
        f"{what}{part}.",
        axes.before,
        axes.after,
        unit,
        f"log-likelihood {number(round(axes.margin))} above that of the best other convention",
    )


def _gyro_bias(diagnosis: Diagnosis) -> Finding | None:
    bias = significant_bias(diagnosis)
    if not bias.any():
        return None
    name, shift, none = diagnosis.angular.name, diagnosis.shift, np.zeros(3)
    return Finding(
        "gyro_bias",
        f"Gyroscope bias {vector(bias, 4)} rad/s, in the recorded axes.",
        rate_error(diagnosis, shift, none, name),
        rate_error(diagnosis, shift, bias, name),
        "rad/s",
        f"standard errors {vector(diagnosis.gyro_bias_deviation, 4)} rad/s",
    )


def _time_offset(diagnosis: Diagnosis) -> Finding | None:
    timing, dt = diagnosis.timing, float(np.median(diagnosis.sequence.dt))
    shift = timing.shift / dt
    if not timing.identifiable or diagnosis.shift in USUAL:
        return None
    when = f"{abs(timing.shift):.3f} s {'before' if timing.shift < 0 else 'after'} their stamps"
    text = f"Velocities describe the interval that begins {when} ({signed(shift, 2)} intervals)"
    if diagnosis.shift == Shift.BEFORE:
        text = (
            "Velocities describe the interval before their stamp, not the one after it. This convention (a shift of "
            f"{signed(float(Shift.BEFORE), 2)} intervals) is the nearest to the estimated shift of {signed(shift, 2)}"
        )
    bias = significant_bias(diagnosis)
    return Finding(
        "time_offset",
        text + ".",
        rate_error(diagnosis, Shift.AFTER, bias, diagnosis.angular.name),
        rate_error(diagnosis, diagnosis.shift, bias, diagnosis.angular.name),
        "rad/s",
        f"standard error {timing.deviation:.4f} s ({timing.deviation / dt:.2f} intervals)",
    )


def _gyro_scale(diagnosis: Diagnosis) -> Finding | None:
    """Finding of a scale of the angular velocity, which the calibration fit does not estimate."""
    units = diagnosis.units
    if units.scale_ratios is None or "angular" in units.given:
        return None
    seen = units.scale_ratios[0]
    if not seen.known or seen.admits(units.time * units.angular, MIN_GYRO_SCALE):
        return None
    scale = units.time * units.angular / seen.ratio
    return Finding(
        "gyro_scale",
        f"The recorded turns are {scale:.3g} times those that the cameras see; the recording does not show which of "
        "the two is wrong, so neither is changed.",
        scale,
        scale,
        "recorded over seen",
        f"correlation {seen.correlation:.2f}",
    )


def _velocity_scale(diagnosis: Diagnosis) -> Finding | None:
    scale, deviation = diagnosis.velocity_scale
    if diagnosis.units.scale_ratios is not None and not diagnosis.units.scale_ratios[1].known:
        return None  # a standing rig: the ratio of two noises
    if abs(scale - 1.0) <= max(MIN_SCALE, SIGNIFICANT * deviation):
        return None
    more = "larger" if scale > 1.0 else "smaller"
    return Finding(
        "velocity_scale",
        f"Recorded speeds are {per_cent(abs(scale - 1.0))} {more} than the stereo speeds; the recording does not "
        "show which of the two is wrong, so neither is changed without a user-specified repair.",
        scale,
        scale,
        "recorded over seen",
        f"standard error {per_cent(deviation)}",
    )


def _extrinsic(diagnosis: Diagnosis) -> Finding | None:
    angle = significant_misalignment(diagnosis)
    if not angle.any():
        return None
    return Finding(
        "extrinsic",
        f"imu_T_cam is turned against the velocities by {np.rad2deg(np.linalg.norm(angle)):.2f}°: about x, y and z by "
        f"{vector(np.rad2deg(angle), 2)}°.",
        float(np.rad2deg(np.linalg.norm(angle))),
        0.0,
        "°",
        f"standard errors {vector(np.rad2deg(diagnosis.misalignment[1]), 2)}°",
    )


def _disparity_offset(diagnosis: Diagnosis) -> Finding | None:
    offset, deviation = significant_offset(diagnosis), diagnosis.disparity_offset[1]
    if not offset:
        return None
    small, changed = ("small", "reduced") if offset > 0 else ("large", "increased")
    return Finding(
        "disparity_offset",
        f"Disparities are {abs(offset):.2f} px too {small}: only with uR {changed} by {abs(offset):.2f} px do near and "
        "far points give the same motion.",
        abs(offset),
        0.0,
        "px",
        f"standard error {deviation:.2f} px",
    )


def _unseen(what: str, axes: Axes) -> str:
    unseen = [name for name, seen in zip("xyz", axes.determined, strict=True) if not seen]
    if not unseen:
        return ""
    if len(unseen) == 3:
        return f"In which axes the {what} was recorded: the motion excites none of them enough."
    rows = axes.name.split(",")
    determined = listed(
        f"recorded {rows['xyz'.index(name)]} is along {name} of the IMU frame of imu_T_cam"
        for name in "xyz"
        if name not in unseen
    )
    return (
        f"The order and the signs of the {listed(unseen)} {noun(len(unseen), 'axis', 'axes')} of the {what}: the "
        f"motion does not excite {noun(len(unseen), 'it', 'them')}. Determined: {determined}."
    )
