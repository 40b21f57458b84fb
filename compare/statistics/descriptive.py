"""Descriptive statistics of errors: infinite errors count, missing ones (NaN) are left out and counted."""

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray

QUANTITIES = ("rmse", "mean", "median", "p95", "max")


def without_nan(values: ArrayLike) -> FloatArray:
    """Values (m,) of (n,) that are not NaN: finite and infinite ones."""
    v = np.asarray(values, dtype=np.float64)
    return np.asarray(v[~np.isnan(v)])


def quantile(values: FloatArray, share: float) -> float:
    """Quantile at `share` (0 to 1) of values (n >= 1,) without NaN, linear between ranks as numpy's.

    Infinite, not NaN, where it lies between a finite value and an infinite one.
    """
    if np.isfinite(values).all():
        return float(np.quantile(values, share))
    here, there = (float(np.quantile(values, share, method=side)) for side in ("lower", "higher"))
    if here == there:
        return here
    if np.isfinite([here, there]).all():
        return here + share * (len(values) - 1) % 1.0 * (there - here)
    return there if np.isinf(there) else here


def summarized(errors: ArrayLike) -> dict[str, float]:
    """RMSE, mean, median, 95th percentile and largest magnitude of errors (n,), and the number `missing` (NaN).

    An infinite error makes RMSE, mean and maximum infinite. All but `missing` are NaN where every error is NaN.
    """
    e = without_nan(errors)
    missing = int(np.size(np.asarray(errors)) - len(e))
    if len(e) == 0:
        return {**dict.fromkeys(QUANTITIES, float("nan")), "missing": missing}
    with np.errstate(over="ignore"):
        rmse = float(np.sqrt(np.mean(e**2)))
    return {
        "rmse": rmse,
        "mean": mean(e),
        "median": quantile(e, 0.5),
        "p95": quantile(e, 0.95),
        "max": float(np.max(np.abs(e))),
        "missing": missing,
    }


def mean(values: FloatArray) -> float:
    """Mean of values (n >= 1,) without NaN; NaN for infinities of both signs."""
    with np.errstate(invalid="ignore"):
        return float(np.mean(values))


def rms_norm(vectors: FloatArray) -> float:
    """Root mean square norm of vectors (n, d)."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))
