"""The figures that sum up a column of errors."""

import numpy as np
from numpy.typing import ArrayLike

QUANTITIES = ("rmse", "mean", "median", "p95", "max")


def summarised(errors: ArrayLike) -> dict[str, float]:
    """RMSE, mean, median, 95th percentile and largest of the finite errors (n,); all NaN where there is none."""
    e = np.asarray(errors, dtype=np.float64)
    e = e[np.isfinite(e)]
    if len(e) == 0:
        return dict.fromkeys(QUANTITIES, float("nan"))
    return {
        "rmse": float(np.sqrt(np.mean(e**2))),
        "mean": float(np.mean(e)),
        "median": float(np.median(e)),
        "p95": float(np.percentile(e, 95)),
        "max": float(np.max(np.abs(e))),
    }
