"""Quaternion order of files without a header: another order is used if it fits clearly better."""

import numpy as np

from fgbaseline.geometry import FloatArray

from .columns import Order

STEP = 20
"""poses between two whose rotation is compared"""
CLEARLY = 3.0
"""factor by which a convention must fit better than the assumed one to be recognized"""
NOTICED = 0.5
"""deg; a misfit below it is no reason to look for another convention"""


def fits_clearly_better(other: float, assumed: float, least: float = NOTICED) -> bool:
    """Whether a convention fits CLEARLY better than the one assumed, by their misfits; those below `least` do not."""
    return assumed > least and CLEARLY * other <= assumed


def in_words(order: Order) -> str:
    """An order as sentences have it, such as `x y z w`."""
    return " ".join(order)


def xyzw(numbers: FloatArray, order: Order) -> FloatArray:
    """Quaternions (n, 4) with w last, of numbers (n, 4) in an order."""
    return numbers if order == "xyzw" else np.roll(numbers, -1, axis=1)
