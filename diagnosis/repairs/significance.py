"""Estimated errors that are significant, and so large that they are repaired."""

import numpy as np

from fgbaseline.geometry import FloatArray

from ..noise.calibration_fit import SIGNIFICANT
from ..velocity_diagnosis.result import Diagnosis

MIN_BIAS = 0.002
"""rad/s"""
MIN_MISALIGNMENT = np.deg2rad(0.25)
MIN_OFFSET = 0.05
"""px"""


def significant_bias(diagnosis: Diagnosis) -> FloatArray:
    """(3,) rad/s in recorded axes; zero where the bias is too small or too uncertain to be taken off."""
    bias, deviation = diagnosis.gyro_bias, diagnosis.gyro_bias_deviation
    if "gyro_bias" in diagnosis.overrides:
        return bias
    found = (np.abs(bias) > MIN_BIAS) & (np.abs(bias) > SIGNIFICANT * deviation)
    return bias if found.any() else np.zeros(3)


def significant_misalignment(diagnosis: Diagnosis) -> FloatArray:
    """(3,) rad; zero in each component that is too small or too uncertain."""
    angle, deviation = diagnosis.misalignment
    if "misalignment_deg" in diagnosis.overrides:
        return angle
    return np.where((np.abs(angle) > MIN_MISALIGNMENT) & (np.abs(angle) > SIGNIFICANT * deviation), angle, 0.0)


def significant_scale(diagnosis: Diagnosis) -> float:
    """By which velocities are divided: 1 unless user-specified, since the stereo baseline may be wrong instead."""
    return diagnosis.velocity_scale[0] if "velocity_scale" in diagnosis.overrides else 1.0


def significant_offset(diagnosis: Diagnosis) -> float:
    """px; zero where the disparity offset is too small or too uncertain."""
    offset, deviation = diagnosis.disparity_offset
    if "disparity_offset_px" in diagnosis.overrides:
        return offset
    return offset if abs(offset) > max(MIN_OFFSET, SIGNIFICANT * deviation) else 0.0
