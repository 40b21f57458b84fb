"""Normalized squared errors, and chi-square quantiles, bounds and p-values of these and their averages."""

import numpy as np
from scipy.special import chdtrc, gammaincinv

from fgbaseline.geometry import FloatArray

PROBABILITY = 0.95
"""probability of the bounds"""


def mahalanobis_squared(error: FloatArray, P: FloatArray) -> FloatArray:
    """Squared Mahalanobis norm e^T P^-1 e (n,) of errors (n, d) with positive definite covariances (n, d, d)."""
    scale = np.sqrt(np.einsum("nii->ni", P))  # to correlations, as the units of components differ
    C = P / (scale[:, :, None] * scale[:, None, :])
    scaled = error / scale
    return np.asarray(np.einsum("ni,ni->n", scaled, np.linalg.solve(C, scaled[:, :, None])[:, :, 0]))


def chi_square_quantile(probability: float, degrees: FloatArray | float) -> FloatArray:
    """Quantiles (...) of chi-square with `degrees` (...) degrees of freedom at this probability."""
    return np.asarray(2.0 * gammaincinv(np.asarray(degrees, dtype=np.float64) / 2.0, probability), dtype=np.float64)


def chi_square_bounds(
    degrees: FloatArray | float, n: FloatArray | float = 1, probability: float = PROBABILITY
) -> tuple[FloatArray, FloatArray]:
    """Two-sided bounds (...) of the mean of n (...) *independent* chi-square values with `degrees` (...) each.

    Their sum is chi-square with n times the degrees. The mean of correlated values (errors of neighboring frames)
    scatters more, at most as much as a single value: n = 1.
    """
    rest, total = (1.0 - probability) / 2.0, np.asarray(n, dtype=np.float64) * degrees
    return chi_square_quantile(rest, total) / n, chi_square_quantile(1.0 - rest, total) / n


def p_value(value: FloatArray, degrees: FloatArray | float) -> FloatArray:
    """Probability (n,) that chi-square is at least `value` (n,) (p-value); uniform in [0, 1] where the model holds."""
    return np.asarray(chdtrc(np.asarray(degrees, dtype=np.float64), value), dtype=np.float64)


def share_inside_bounds(values: FloatArray, degrees: FloatArray | float, probability: float = PROBABILITY) -> float:
    """Share of the values (n,) without NaN inside the bounds of a single value; NaN where there is none."""
    low, high = (np.broadcast_to(limit, values.shape) for limit in chi_square_bounds(degrees, 1, probability))
    known = ~np.isnan(values)
    inside = (values[known] >= low[known]) & (values[known] <= high[known])
    return float(inside.mean()) if known.any() else float("nan")
