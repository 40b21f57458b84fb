"""What chi-square says of a normalised squared error, and of averages of several."""

import numpy as np
from scipy.special import chdtrc, gammaincinv

from fgbaseline.geometry import FloatArray

PROBABILITY = 0.95
"""that a bound is to hold with"""


def quantile(probability: float, degrees: FloatArray | float) -> FloatArray:
    """The value that chi-square with so many `degrees` of freedom stays below with this probability."""
    return np.asarray(2.0 * gammaincinv(np.asarray(degrees, dtype=np.float64) / 2.0, probability), dtype=np.float64)


def bounds(
    degrees: FloatArray | float, n: FloatArray | float = 1, probability: float = PROBABILITY
) -> tuple[FloatArray, FloatArray]:
    """Two-sided bounds of the mean of n *independent* values of chi-square with so many degrees of freedom each.

    The sum of the n is chi-square with n times the degrees. Where the values are not independent (a filter's errors in
    neighbouring frames never are), the mean scatters more than this, at most as much as one value does: n = 1.
    """
    rest, total = (1.0 - probability) / 2.0, np.asarray(n, dtype=np.float64) * degrees
    return quantile(rest, total) / n, quantile(1.0 - rest, total) / n


def probability_beyond(value: FloatArray, degrees: FloatArray | float) -> FloatArray:
    """That chi-square is at least `value` (p-value); uniform between 0 and 1 where the model holds."""
    return np.asarray(chdtrc(np.asarray(degrees, dtype=np.float64), value), dtype=np.float64)


def share_inside(values: FloatArray, degrees: FloatArray | float, probability: float = PROBABILITY) -> float:
    """Which share of the values (n,), without NaN, lies inside the bounds of a single one; NaN where there is none."""
    low, high = (np.broadcast_to(limit, values.shape) for limit in bounds(degrees, 1, probability))
    known = ~np.isnan(values)
    inside = (values[known] >= low[known]) & (values[known] <= high[known])
    return float(inside.mean()) if known.any() else float("nan")
