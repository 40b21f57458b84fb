"""Sums over a moving window, in a time that does not depend on its width."""

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray


def moving_sum(values: ArrayLike, width: float) -> FloatArray:
    """(n,) sums of values (n,) over the `width` entries around each, as many of them as there are.

    The window is rounded to whole entries, at least one; an even one reaches one entry further back than ahead.
    """
    known = np.asarray(values, dtype=np.float64)
    n = len(known)
    size = max(1, round(min(width, 2.0 * n)))
    last = np.arange(n) + (size - 1) // 2
    total = np.concatenate([[0.0], np.cumsum(known)])
    return np.asarray(total[np.minimum(last + 1, n)] - total[np.maximum(last + 1 - size, 0)])
