"""Decomposition of the position error into scale, heading and remainder, with bootstrap intervals."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.data.display import Displayed
from fgbaseline.geometry import FloatArray

from ..statistics.block_bootstrap import MAX_BLOCKS, MIN_BLOCKS, REPETITIONS, Bounded, block_length
from ..statistics.bootstrap_resampling import CONFIDENCE, draw_blocks, percentile_interval
from .alignment import Align
from .association import MatchedTrajectories

if TYPE_CHECKING:
    import pandas as pd

SCALE, WHOLE = 1, 3
"""columns of the basis in each nested fit"""


@dataclass(frozen=True, slots=True)
class ErrorDecomposition:
    """Shares of the sum of squared position errors, which add up to one; NaN where every error is zero."""

    scale: float
    """share explained by an error of scale"""
    heading: float
    """additional share explained by an error of heading: constant plus linear in time (gyroscope bias)"""
    noise: float
    """unexplained share: tilt, random walk and the rest"""
    scale_percent: float
    """100 times the coefficient s of the fit, %; not the relative path length"""
    heading_deg: float
    """fitted constant heading error, deg, left positive"""
    heading_deg_per_s: float
    """fitted heading drift, deg/s (deg per pose without stamps)"""
    rms: float
    """RMS of the error itself, m"""


def error_decomposition(matched: MatchedTrajectories, up: ArrayLike = (0.0, 0.0, 1.0)) -> ErrorDecomposition:
    """Nested least-squares fits of the position error d_k = p_k - r_k (m), scale first:

    d_k = s (r_k - r_a), then d_k = s (r_k - r_a) + h up x (r_k - r_a) + g (up x integral of (t - t_a) dr). A share is
    the reduction of the residual sum of squares by its fit, over the sum of squares of d. The anchor r_a is the
    first pose where the paths start together (`none`, `first-pose`) and the centroid after alignments over
    the whole path. First order in the angles: above 20 deg of heading error, part counts as scale and noise.
    """
    d, columns = decomposition_basis(matched, up)
    total = float(np.sum(d**2))
    basis = columns.reshape(-1, WHOLE)
    (_, after_scale), (fitted, after_heading) = (_fit(basis[:, :m], d.ravel()) for m in (SCALE, WHOLE))
    if total == 0.0:
        shares = (np.nan, np.nan, np.nan)
    else:
        shares = (1.0 - after_scale / total, (after_scale - after_heading) / total, after_heading / total)
    return ErrorDecomposition(
        *shares,
        scale_percent=100.0 * float(fitted[0]),
        heading_deg=float(np.rad2deg(fitted[1])),
        heading_deg_per_s=float(np.rad2deg(fitted[2])),
        rms=float(np.sqrt(total / len(d))),
    )


def decomposition_basis(matched: MatchedTrajectories, up: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Position error d (n, 3), m, and basis (n, 3, 3) with a column each for scale, heading and heading drift."""
    r = matched.reference.position
    d = matched.estimate.position - r
    t = matched.reference.t - matched.reference.t[0]
    upward = np.asarray(up, dtype=np.float64) / np.linalg.norm(up)
    steps = 0.5 * (t[1:] + t[:-1])[:, None] * np.cross(upward, np.diff(r, axis=0))
    drifting = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    columns = [r - r[0], np.cross(upward, r - r[0]), drifting]
    if matched.alignment.kind not in (Align.NONE, Align.FIRST_POSE):
        columns = [column - column.mean(axis=0) for column in columns]
    return d, np.stack(columns, axis=2)


def _fit(basis: FloatArray, wanted: FloatArray) -> tuple[FloatArray, float]:
    """Coefficients and residual sum of squares; minimum-norm coefficients where they are undetermined."""
    size = np.linalg.norm(basis, axis=0)
    size = np.where(size > 0, size, 1.0)
    coefficients = np.linalg.lstsq(basis / size, wanted, rcond=1e-12)[0] / size
    return coefficients, float(np.sum((wanted - basis @ coefficients) ** 2))


NAMES = ("scale", "heading", "noise")


@dataclass(frozen=True, slots=True, repr=False)
class ShareIntervals(Displayed):
    """Bootstrap intervals of the shares of an error decomposition."""

    by_name: Mapping[str, Bounded]
    """scale, heading and noise"""
    block: int
    """block length, in poses"""
    reliable: bool
    """see `ErrorStatistics.reliable`"""


def decomposition_intervals(
    matched: MatchedTrajectories,
    up: ArrayLike = (0.0, 0.0, 1.0),
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
) -> "pd.DataFrame":
    """Table of `share_intervals`: columns `value`, `low`, `high`; `attrs` have `block` and `reliable`."""
    import pandas as pd

    found = share_intervals(matched, up, confidence=confidence, repetitions=repetitions, seed=seed)
    rows = pd.Index(found.by_name, name="share")
    table = pd.DataFrame(list(found.by_name.values()), index=rows, columns=list(Bounded._fields))
    table.attrs = {"block": found.block, "reliable": found.reliable}
    return table


def share_intervals(
    matched: MatchedTrajectories,
    up: ArrayLike = (0.0, 0.0, 1.0),
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
) -> ShareIntervals:
    """Bootstrap intervals of the shares of `error_decomposition`.

    The fits are repeated on blocks of poses drawn with replacement, so an interval is wide where few stretches decide.
    The block length is Politis and White's for the squared errors. Shares are not
    negative, so draws of a small one lie above it: the interval is extended to include it. NaN for zero errors.
    """
    shares = error_decomposition(matched, up)
    value = np.array([getattr(shares, name) for name in NAMES])
    low, high = np.full((2, len(NAMES)), np.nan)
    d, basis = decomposition_basis(matched, up)
    squared = np.sum(d**2, axis=1)
    found, n = block_length(squared), len(d)
    block = max(found.length, -(-n // MAX_BLOCKS))
    if n > 1 and np.isfinite(value).all():
        size = np.sqrt(np.sum(basis**2, axis=(0, 1)))
        rows = np.concatenate([basis / np.where(size > 0, size, 1.0), d[:, :, None] / np.sqrt(squared.sum())], axis=2)
        products = np.einsum("nia,nib->nab", rows, rows).reshape(n, -1)
        drawn = draw_blocks(n, block, repetitions, seed).sums(products).reshape(-1, WHOLE + 1, WHOLE + 1)
        drawn = drawn[drawn[:, -1, -1] > 0.0]  # a draw without any difference has no shares
        if len(drawn):
            low, high = percentile_interval(_shares(drawn), confidence)
            low, high = np.minimum(low, value), np.maximum(high, value)
    rows = np.stack([value, low, high], axis=1).tolist()
    return ShareIntervals(
        by_name={name: Bounded(*row) for name, row in zip(NAMES, rows, strict=True)},
        block=block,
        reliable=n / block >= MIN_BLOCKS and found.correlation_ends,
    )


def _shares(products: FloatArray) -> FloatArray:
    """Shares (r, 3) from the Gram matrices (r, 4, 4) of the three basis columns and the error."""
    total = products[:, -1, -1]
    after_scale, after_all = (_left(products, columns) / total for columns in (SCALE, WHOLE))
    return np.stack([1.0 - after_scale, after_scale - after_all, after_all], axis=1).clip(0.0, 1.0)


def _left(products: FloatArray, columns: int) -> FloatArray:
    """Residual sum of squares (r,) of a fit of the first `columns`."""
    A, b = products[:, :columns, :columns], products[:, :columns, -1]
    explained = np.einsum("ri,rij,rj->r", b, np.linalg.pinv(A, rcond=1e-12, hermitian=True), b)
    return np.asarray(products[:, -1, -1] - explained)
