"""How sure the shares of a difference are: which stretches of the path they rest on."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray

from ..statistics.block_bootstrap import CONFIDENCE, FEWEST_BLOCKS, MOST_BLOCKS, REPETITIONS, tails
from ..statistics.block_draws import draw_blocks
from ..statistics.block_length import block_length
from .association import Matched
from .error_decomposition import SCALE, WHOLE, difference_basis, difference_shares

NAMES = ("scale", "heading", "noise")


def share_intervals(
    matched: Matched,
    up: ArrayLike = (0.0, 0.0, 1.0),
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
) -> pd.DataFrame:
    """`value`, `low`, `high` of each of the `difference_shares`: of fits to paths put together from blocks of poses.

    The fits are repeated on poses drawn in blocks, each with its difference and its place, so an interval is wide where
    a few stretches decide. The block length is Politis and White's for the squared differences; `attrs["reliable"]` is
    as in `error_statistics`, False for most differences that grow with the path. A share has no room below zero, so
    draws lie above a small one: the interval is made to reach it. All NaN where there is no difference.
    """
    shares = difference_shares(matched, up)
    value = np.array([getattr(shares, name) for name in NAMES])
    table = pd.DataFrame({"value": value, "low": np.nan, "high": np.nan}, index=pd.Index(NAMES, name="share"))
    d, basis = difference_basis(matched, up)
    squared = np.sum(d**2, axis=1)
    found, n = block_length(squared), len(d)
    block = max(found.length, -(-n // MOST_BLOCKS))
    table.attrs = {"block": block, "reliable": n / block >= FEWEST_BLOCKS and found.correlation_ends}
    if n > 1 and np.isfinite(value).all():
        size = np.sqrt(np.sum(basis**2, axis=(0, 1)))
        rows = np.concatenate([basis / np.where(size > 0, size, 1.0), d[:, :, None] / np.sqrt(squared.sum())], axis=2)
        products = np.einsum("nia,nib->nab", rows, rows).reshape(n, -1)
        drawn = draw_blocks(n, block, repetitions, seed).sums(products).reshape(-1, WHOLE + 1, WHOLE + 1)
        drawn = drawn[drawn[:, -1, -1] > 0.0]  # a draw without any difference has no shares
        if len(drawn):
            low, high = tails(_shares(drawn), confidence)
            table["low"], table["high"] = np.minimum(low, value), np.maximum(high, value)
    return table


def _shares(products: FloatArray) -> FloatArray:
    """(r, 3) shares from the products (r, 4, 4) of the three columns of the basis and the difference."""
    total = products[:, -1, -1]
    after_scale, after_all = (_left(products, columns) / total for columns in (SCALE, WHOLE))
    return np.stack([1.0 - after_scale, after_scale - after_all, after_all], axis=1).clip(0.0, 1.0)


def _left(products: FloatArray, columns: int) -> FloatArray:
    """(r,) what a fit of the first `columns` leaves of the sum of squares."""
    A, b = products[:, :columns, :columns], products[:, :columns, -1]
    explained = np.einsum("ri,rij,rj->r", b, np.linalg.pinv(A, rcond=1e-12, hermitian=True), b)
    return np.asarray(products[:, -1, -1] - explained)
