"""A diagnosis of raw inertial data as JSON, and its values in sentences."""

from dataclasses import asdict
from typing import Any

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.wording import capitalized, vector

from ..findings.json_report import header
from .findings import inertial_findings
from .result import InertialDiagnosis
from .sensor_calibration import SensorChecks


def inertial_to_json(found: InertialDiagnosis, findings: tuple[Finding, ...] | None = None) -> dict[str, Any]:
    """The contents of `diagnosis.json`: numbers, texts, lists and dicts, None where the cameras determine nothing."""
    findings = inertial_findings(found) if findings is None else findings
    imu = found.sequence.imu
    assert imu is not None
    report = header(found.sequence) | {
        "imu": {
            "samples": len(imu),
            "period_s": imu.period,
            "noise": imu.noise.densities.tolist(),
            "gravity": imu.gravity,
        },
        "cannot_tell": found.failure_reason or None,
        "findings": [asdict(finding) for finding in findings],
        "start": _start(found),
        "sensors": _sensors(found),
        "sigma": {"pixel": found.pixel if found.pixel_found else None},
    }
    return {key: _finite(value) for key, value in report.items()}


def _finite(value: Any) -> Any:
    """The value with None for each number in it that is not finite, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _start(found: InertialDiagnosis) -> dict[str, Any] | None:
    start = found.start
    if start is None:
        return None
    return {
        "source": start.state.source,
        "standing_s": start.standing,
        "up_imu": start.pose[2, :3].tolist(),
        "velocity": start.state.velocity.tolist(),
        "gyroscope_bias": start.state.gyroscope_bias.tolist(),
        "accelerometer_bias": start.state.accelerometer_bias.tolist(),
        "std": np.sqrt(np.diag(start.state.covariance)).tolist(),
    }


def _sensors(found: InertialDiagnosis) -> dict[str, Any] | None:
    checks = found.sensors
    if checks is None or not checks.determined:
        return None
    return {
        "gyro_bias": checks.gyroscope_bias[0].tolist(),
        "gyro_bias_std": checks.gyroscope_bias[1].tolist(),
        "misalignment_deg": np.rad2deg(checks.misalignment[0]).tolist(),
        "misalignment_std_deg": np.rad2deg(checks.misalignment[1]).tolist(),
        "time_offset_s": checks.time_offset[0],
        "time_offset_std_s": checks.time_offset[1],
        "gyro_scale": checks.gyroscope_scale[0],
        "gyro_scale_std": checks.gyroscope_scale[1],
        "accelerometer_bias": None if checks.accelerometer_bias is None else checks.accelerometer_bias.tolist(),
        "gravity_measured": None if checks.gravity is None else checks.gravity[0],
        "rest": None if checks.rest is None else checks.rest._asdict(),
    }


def _accelerometer(checks: SensorChecks) -> str:
    if checks.accelerometer_bias is None or checks.gravity is None:
        return ""
    bias, gravity = vector(checks.accelerometer_bias, 3), checks.gravity[0]
    return f"; accelerometer: bias {bias} m/s^2, gravity {gravity:.3f} m/s^2"


def inertial_sentences(found: InertialDiagnosis) -> tuple[str, ...]:
    """Start, sensors and pixel noise, one sentence each."""
    sentences = []
    if found.start is not None:
        state, deviation = found.start.state, np.sqrt(np.diag(found.start.state.covariance))
        sentences.append(
            f"Start ({state.source}): velocity {vector(state.velocity, 3)} m/s, standard errors "
            f"{vector(deviation[6:9], 3)}; tilt known to {np.rad2deg(np.linalg.norm(deviation[3:6])):.2f}°."
        )
    checks = found.sensors
    if checks is not None and checks.determined:
        scale, error = checks.gyroscope_scale
        sentences.append(
            f"Gyroscope against the cameras: bias {vector(checks.gyroscope_bias[0], 4)} rad/s, offset "
            f"{1e3 * checks.time_offset[0]:.1f} ms, scale {scale:.3f} (standard error {error:.3f})"
            f"{_accelerometer(checks)}."
        )
    if found.monocular is not None:
        remark = found.monocular.remark
        sentences.append(f"{capitalized(remark)}.")
    if found.pixel_found:
        sentences.append(f"Noise (1-sigma): {found.pixel:.2f} px of a pixel row.")
    return tuple(sentences)
