"""Statistics of a column of errors: what is infinite counts, what is missing (NaN) is counted apart."""

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray

QUANTITIES = ("rmse", "mean", "median", "p95", "max")


def known(values: ArrayLike) -> FloatArray:
    """(m,) the values (n,) that are numbers: finite ones and infinities, without NaN."""
    v = np.asarray(values, dtype=np.float64)
    return np.asarray(v[~np.isnan(v)])


def quantile(values: FloatArray, share: float) -> float:
    """The quantile at `share` (0 to 1) of values (n >= 1,) without NaN, linear between ranks as numpy's.

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


def summarised(errors: ArrayLike) -> dict[str, float]:
    """RMSE, mean, median, 95th percentile and largest size of the errors (n,), and how many are `missing`.

    An infinite error makes RMSE, mean and largest infinite. NaN is no error: it is left out and counted in `missing`.
    All but `missing` are NaN where no error is left.
    """
    e = known(errors)
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
    """The mean of values (n >= 1,) without NaN; NaN where infinities of both signs leave it open."""
    with np.errstate(invalid="ignore"):
        return float(np.mean(values))
