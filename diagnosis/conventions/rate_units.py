"""Decision whether a measured factor of velocities is that of a unit, or of raw counts of a gyroscope.

mrad/s and the 16.4 counts per °/s of a usual range are only 6 % apart, so that the factor has to be known well.
"""

import numpy as np

from .scale_ratio import ScaleRatio

DEGREE = float(np.pi / 180.0)
COUNTS = (131.0, 114.3, 65.5, 57.1, 32.8, 28.6, 16.4, 14.3)
"""per °/s, of the ranges of usual gyroscopes (InvenSense, Bosch, ST)"""
CALIBRATED = 0.04
"""share by which gyroscope and cameras together may be off"""


def doubt_of_rate_unit(seen: ScaleRatio, factor: float, noun: str, time: float = 1.0) -> str:
    """Why rates cannot be in the unit of `factor` rad/s, called `noun`, in words; empty where they can.

    `seen` is the ratio of the turns that the cameras see to those recorded; stamps are in `time` s. In rad/s, any other
    ratio than 1 is an error of scale.
    """
    if factor == 1.0 or not seen.known:
        return ""
    counts = [f"{count:g}" for count in COUNTS if seen.admits(time * DEGREE / count, CALIBRATED)]
    raw = f"raw counts of a gyroscope, {' or '.join(counts)} per °/s" if counts else ""
    if not seen.admits(time * factor, CALIBRATED):
        return f"{of_no_unit('turns', seen)}{f': they may be {raw}' if raw else ''}"
    return f"{measured('turns', seen)}: they may be in {noun}, or {raw}" if raw else ""


def of_no_unit(what: str, seen: ScaleRatio) -> str:
    """A measured ratio that is the factor of no unit, in words."""
    return f"{measured(what, seen)}, which is the factor of no unit"


def measured(what: str, seen: ScaleRatio) -> str:
    """A measured ratio, in words."""
    return f"the recorded {what} are {1.0 / seen.ratio:.4g} times those that the cameras see"
