"""Findings on gyroscope and accelerometer, in sentences."""

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.wording import per_cent, vector

from ..noise.calibration_fit import SIGNIFICANT
from .sensor_calibration import SensorChecks

MIN_BIAS, MIN_ANGLE, MIN_OFFSET, MIN_SCALE = 0.005, np.deg2rad(0.5), 0.003, 0.02
"""rad/s, rad, s and share that are reported; the biases are in the state of the estimators"""
MIN_ACCELEROMETER_BIAS, MIN_GRAVITY = 0.3, 0.15
"""m/s^2"""
NOISIER = 2.0
"""factor on the stated noise density above which samples are noisier than stated"""


def sensor_findings(checks: SensorChecks, densities: tuple[float, float] | None = None) -> tuple[Finding, ...]:
    """Significant faults; `densities` of gyroscope and accelerometer are those that the recording states."""
    found = [*_gyroscope(checks), *_accelerometer(checks)]
    if densities is not None:
        found += _noise(checks, densities)
    return tuple(found)


def _significant(value: float, deviation: float, least: float) -> bool:
    return abs(value) > max(least, SIGNIFICANT * deviation)


def _gyroscope(checks: SensorChecks) -> list[Finding]:
    found = []
    before, after = checks.rate_error
    bias, deviation = checks.gyroscope_bias
    if any(_significant(b, d, MIN_BIAS) for b, d in zip(bias, deviation, strict=True)):
        text = f"Gyroscope bias {vector(bias, 4)} rad/s: it is in the state of the estimators."
        certainty = f"standard errors {vector(deviation, 4)} rad/s"
        found.append(Finding("gyro_bias", text, before, after, "rad/s", certainty))
    angle, deviation = checks.misalignment
    if any(_significant(a, d, MIN_ANGLE) for a, d in zip(angle, deviation, strict=True)):
        size = float(np.rad2deg(np.linalg.norm(angle)))
        text = (
            f"imu_T_cam is turned against the gyroscope by {size:.2f}°: about x, y and z by "
            f"{vector(np.rad2deg(angle), 2)}°."
        )
        certainty = f"standard errors {vector(np.rad2deg(deviation), 2)}°"
        found.append(Finding("extrinsic", text, size, size, "°", certainty))
    offset, error = checks.time_offset
    if _significant(offset, error, MIN_OFFSET):
        when = "after" if offset > 0.0 else "before"
        text = (
            f"The gyroscope turns {1e3 * abs(offset):.1f} ms {when} the cameras: stamps of two clocks, or a filter of "
            "the unit. Estimators take the stamps as they are."
        )
        found.append(Finding("time_offset", text, abs(offset), abs(offset), "s", f"standard error {error:.4f} s"))
    scale, error = checks.gyroscope_scale
    if _significant(scale - 1.0, error, MIN_SCALE):
        text = f"The gyroscope turns {scale:.3f} times as far as the cameras see."
        found.append(
            Finding("gyro_scale", text, scale, scale, "recorded over seen", f"standard error {per_cent(error)}")
        )
    return found


def _accelerometer(checks: SensorChecks) -> list[Finding]:
    found = []
    bias = checks.accelerometer_bias
    size = 0.0 if bias is None else float(np.linalg.norm(bias))
    if bias is not None and size > MIN_ACCELEROMETER_BIAS:
        text = f"Accelerometer bias {vector(bias, 3)} m/s^2: it is in the state of the estimators."
        found.append(Finding("accelerometer_bias", text, size, size, "m/s^2", "by the whole trajectory"))
    gravity, given = checks.gravity or (0.0, 0.0)
    if abs(gravity - given) > MIN_GRAVITY:
        text = (
            f"The accelerometer measures a gravity of {gravity:.3f} m/s^2 in place of {given:g}: a bias along the "
            "vertical, a scale, or another magnitude of gravity."
        )
        found.append(Finding("gravity", text, gravity, gravity, "m/s^2", "by the whole trajectory"))
    for name, value, count in checks.saturated:
        text = f"The {name} stays at {value:.6g} for several samples at once: its range ends there."
        found.append(Finding("saturated", text, count, count, "samples", "counted"))
    return found


def _noise(checks: SensorChecks, densities: tuple[float, float]) -> list[Finding]:
    rest = checks.rest
    if rest is None:
        return []
    found = []
    measured = (
        ("gyroscope", rest.gyroscope, "rad/s/sqrt(Hz)"),
        ("accelerometer", rest.accelerometer, "m/s^2/sqrt(Hz)"),
    )
    for (name, density, unit), stated in zip(measured, densities, strict=True):
        if density > NOISIER * stated:
            text = (
                f"At rest ({rest.duration:.1f} s) the {name} has {density:.3g} {unit}, {density / stated:.1f} times "
                f"the stated {stated:.3g}: vibration, or a density from a bench."
            )
            certainty = f"Allan deviation at {rest.averaging:.3g} s"
            found.append(Finding(f"{name}_noise", text, density, density, unit, certainty))
    return found
