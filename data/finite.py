"""Whether a value read from a file is a number that a double can hold, and one that a sensor can measure."""

import sys
from typing import TypeGuard

import numpy as np

from fgbaseline.geometry import FloatArray

from .observations import BoolArray

LARGEST = 1e60
"""in whatever unit: no sensor measures more, and products of larger numbers overflow"""


def measurable(values: FloatArray) -> BoolArray:
    """Whether values (...) are finite and at most LARGEST, so that their products are finite too."""
    return np.asarray(np.abs(values) <= LARGEST)


def is_finite_number(value: object) -> TypeGuard[int | float]:
    """No infinity, NaN or truth value. An integer too large for a double must not be turned into one to be told."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
