"""Paired block bootstrap: differences of RMSE between estimates over the same stamps, and their ranking."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray, InputError

from .block_bootstrap import MAX_BLOCKS, MIN_BLOCKS, REPETITIONS, block_length
from .bootstrap_resampling import CONFIDENCE, draw_blocks, percentile_interval

MIN_DIFFERENCE = 0.01
"""smallest difference of two errors that is claimed, as a share of the smaller: paired errors make less significant,
but it has no consequence"""


@dataclass(frozen=True, slots=True)
class RmseDifference:
    """Difference of two RMSEs over the same stamps, with its interval."""

    value: float
    low: float
    high: float
    block: int
    """block length, in stamps"""
    blocks: float
    """number of blocks that fit into the series"""
    reliable: bool
    """whether at least `MIN_BLOCKS` blocks fit and the correlation of the difference ends within the series"""

    @property
    def settled(self) -> bool:
        """Whether the interval excludes zero on the side of the difference."""
        return (self.low > 0.0 and self.value > 0.0) or (self.high < 0.0 and self.value < 0.0)


def is_level(larger: float, smaller: float) -> bool:
    """Whether an error exceeds another by at most `MIN_DIFFERENCE`, if at all."""
    return larger <= (1.0 + MIN_DIFFERENCE) * smaller


def is_claimed(difference: RmseDifference, larger: float, smaller: float) -> bool:
    """Whether an RMSE is larger than another, significantly and by more than `MIN_DIFFERENCE`."""
    return difference.settled and difference.value > 0.0 and larger > smaller and not is_level(larger, smaller)


def rmse_difference(
    errors: ArrayLike,
    others: ArrayLike,
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
) -> RmseDifference:
    """RMSE of `errors` (n,) minus that of `others` (n,), with the interval of a paired moving-block bootstrap.

    Both are of the same stamps, in order; stamps where either is NaN are left out. Infinite errors make the
    difference infinite, or NaN if both have such errors. Each repetition draws the same blocks for both,
    which cancels variation that they share: the order can be settled although the intervals of the two RMSEs overlap.
    The block length is Politis and White's for the differences of squared errors.

    Raises InputError for unequal lengths.
    """
    pair = [np.asarray(e, dtype=np.float64) for e in (errors, others)]
    if pair[0].shape != pair[1].shape or pair[0].ndim != 1:
        raise InputError(f"expected errors (n,) at the same n stamps, got shapes {pair[0].shape} and {pair[1].shape}")
    squares: FloatArray = np.stack(pair, axis=1) ** 2
    squares = squares[~np.isnan(squares).any(axis=1)]
    n = len(squares)
    if n == 0:
        return RmseDifference(np.nan, np.nan, np.nan, 1, 0.0, False)
    infinite = np.isinf(squares)
    if infinite.any():
        first, second = np.sqrt(squares.mean(axis=0))
        value = float("nan") if infinite.any(axis=0).all() else float(first - second)
        return RmseDifference(value, np.nan, np.nan, 1, float(n), False)
    found = block_length(squares[:, 0] - squares[:, 1])
    block = max(found.length, -(-n // MAX_BLOCKS))
    drawn = np.sqrt(draw_blocks(n, block, repetitions, seed).sums(squares) / n)
    low, high = percentile_interval(drawn[:, :1] - drawn[:, 1:], confidence)[:, 0]
    first, second = np.sqrt(squares.mean(axis=0))
    reliable = n / block >= MIN_BLOCKS and found.correlation_ends
    return RmseDifference(float(first - second), float(low), float(high), block, n / block, reliable)


@dataclass(frozen=True, slots=True)
class PairedRanking:
    """Estimates ranked by RMSE over the same stamps, smallest first."""

    rmse: Mapping[str, float]
    """RMSE by name, in rising order"""
    behind: Mapping[str, RmseDifference]
    """RMSE of each but the first minus that of the first; value >= 0 where both are finite"""
    moments: int
    """number of stamps at which all of them have an error"""
    errors: Mapping[str, FloatArray] = field(repr=False, compare=False)
    """(moments,) by name, in that order"""
    seed: int
    """seed of the bootstrap"""

    def difference(self, name: str, other: str) -> RmseDifference:
        """RMSE of one minus that of another, over the stamps at which all of them have an error."""
        return rmse_difference(self.errors[name], self.errors[other], seed=self.seed)


def paired_ranking(errors: Mapping[str, ArrayLike], *, seed: int = 0) -> PairedRanking:
    """Rank errors (n,) at the same n stamps by their RMSE over the stamps at which none of them is NaN.

    `behind` holds `rmse_difference` of each from the first. Raises InputError for unequal lengths.
    """
    columns = {name: np.asarray(e, dtype=np.float64) for name, e in errors.items()}
    if len({column.shape for column in columns.values()}) > 1:
        raise InputError(
            f"expected errors (n,) at the same n stamps, got shapes {sorted({each.shape for each in columns.values()})}"
        )
    everywhere = ~np.any([np.isnan(column) for column in columns.values()], axis=0)
    common = {name: column[everywhere] for name, column in columns.items()} if columns else {}
    if not any(len(column) for column in common.values()):
        return PairedRanking({}, {}, 0, {}, seed)
    rmse = {name: float(np.sqrt(np.mean(column**2))) for name, column in common.items()}
    order = sorted(rmse, key=lambda name: rmse[name])
    common = {name: common[name] for name in order}
    behind = {name: rmse_difference(common[name], common[order[0]], seed=seed) for name in order[1:]}
    return PairedRanking({name: rmse[name] for name in order}, behind, int(np.sum(everywhere)), common, seed)
