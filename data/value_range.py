"""Range of values that a sensor can measure, in any unit."""

import numpy as np

from fgbaseline.geometry import FloatArray

from .observations import BoolArray

LARGEST = 1e60
"""largest plausible measurement in any unit; products of larger numbers could overflow"""


def measurable(values: FloatArray) -> BoolArray:
    """True where values (...) are finite and at most LARGEST in magnitude."""
    return np.asarray(np.abs(values) <= LARGEST)
