"""Numbers that a sensor can measure, whatever their unit."""

import numpy as np

from fgbaseline.geometry import FloatArray

from .observations import BoolArray

LARGEST = 1e60
"""in any unit: no sensor measures more, and products of larger numbers overflow"""


def measurable(values: FloatArray) -> BoolArray:
    """Whether values (...) are finite and at most LARGEST, so that their products are finite too."""
    return np.asarray(np.abs(values) <= LARGEST)
