"""Significance of the estimated calibration errors: only significant and large ones are repaired."""

import numpy as np

from fgbaseline.geometry import FloatArray

from ..body_velocity.result import Diagnosis
from ..noise.calibration_fit import SIGNIFICANT

MIN_BIAS = 0.002
"""rad/s, largest component of a gyroscope bias below which it is not repaired"""
MIN_MISALIGNMENT = np.deg2rad(0.25)
"""rad, component of the extrinsic rotation error below which it is not repaired"""
MIN_OFFSET = 0.05
"""px, disparity offset below which it is not repaired"""


def significant_bias(diagnosis: Diagnosis) -> FloatArray:
    """Gyroscope bias (3,), rad/s in recorded axes; zero if it is too small or too uncertain to be subtracted."""
    bias, deviation = diagnosis.gyro_bias, diagnosis.gyro_bias_deviation
    if "gyro_bias" in diagnosis.overrides:
        return bias
    found = (np.abs(bias) > MIN_BIAS) & (np.abs(bias) > SIGNIFICANT * deviation)
    return bias if found.any() else np.zeros(3)


def significant_misalignment(diagnosis: Diagnosis) -> FloatArray:
    """Rotation error (3,) of imu_T_cam, rad; each component is zero if it is too small or too uncertain."""
    angle, deviation = diagnosis.misalignment
    if "misalignment_deg" in diagnosis.overrides:
        return angle
    return np.where((np.abs(angle) > MIN_MISALIGNMENT) & (np.abs(angle) > SIGNIFICANT * deviation), angle, 0.0)


def significant_scale(diagnosis: Diagnosis) -> float:
    """Divisor of the linear velocity: 1 unless user-specified, since the baseline may be wrong in its place."""
    return diagnosis.velocity_scale[0] if "velocity_scale" in diagnosis.overrides else 1.0


def significant_offset(diagnosis: Diagnosis) -> float:
    """Disparity offset, px; zero if it is too small or too uncertain."""
    offset, deviation = diagnosis.disparity_offset
    if "disparity_offset_px" in diagnosis.overrides:
        return offset
    return offset if abs(offset) > max(MIN_OFFSET, SIGNIFICANT * deviation) else 0.0
