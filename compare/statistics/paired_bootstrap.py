"""Which of several estimates is nearer, and whether the recording settles it: all drawn with the same blocks."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray, InputError

from .block_bootstrap import CONFIDENCE, FEWEST_BLOCKS, MOST_BLOCKS, REPETITIONS, tails
from .block_draws import draw_blocks
from .block_length import block_length


@dataclass(frozen=True, slots=True)
class RmseDifference:
    """The RMSE of one estimate's errors less that of another's at the same moments."""

    value: float
    low: float
    high: float
    block: int
    """moments in a row that are kept together"""
    reliable: bool
    """whether at least `FEWEST_BLOCKS` fit, and the correlation of the difference ends within the series"""

    @property
    def settled(self) -> bool:
        """Whether the interval has a sign, and it is that of the difference."""
        return (self.low > 0.0 and self.value > 0.0) or (self.high < 0.0 and self.value < 0.0)


def rmse_difference(
    errors: ArrayLike,
    others: ArrayLike,
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
) -> RmseDifference:
    """RMSE of `errors` (n,) less that of `others` (n,), with the interval of a paired moving-block bootstrap.

    Both have to be of the same moments, in order; moments where either is NaN are left out. Infinite errors count: the
    difference is then infinite, or NaN and unsettled where both have some. Each repetition
    draws the same blocks of moments for both, so that what makes a stretch hard for both does not blur which is better:
    intervals of the two RMSEs can overlap and the order be clear all the same. The block length is Politis and White's
    for the differences of the squared errors. Raises InputError where they are not of one length.
    """
    pair = [np.asarray(e, dtype=np.float64) for e in (errors, others)]
    if pair[0].shape != pair[1].shape or pair[0].ndim != 1:
        raise InputError(f"errors at the same moments are needed, got {pair[0].shape} and {pair[1].shape} of them")
    squares: FloatArray = np.stack(pair, axis=1) ** 2
    squares = squares[~np.isnan(squares).any(axis=1)]
    n = len(squares)
    if n == 0:
        return RmseDifference(np.nan, np.nan, np.nan, 1, False)
    infinite = np.isinf(squares)
    if infinite.any():
        first, second = np.sqrt(squares.mean(axis=0))
        value = float("nan") if infinite.any(axis=0).all() else float(first - second)
        return RmseDifference(value, np.nan, np.nan, 1, False)
    found = block_length(squares[:, 0] - squares[:, 1])
    block = max(found.length, -(-n // MOST_BLOCKS))
    drawn = np.sqrt(draw_blocks(n, block, repetitions, seed).sums(squares) / n)
    low, high = tails(drawn[:, :1] - drawn[:, 1:], confidence)[:, 0]
    first, second = np.sqrt(squares.mean(axis=0))
    reliable = n / block >= FEWEST_BLOCKS and found.correlation_ends
    return RmseDifference(float(first - second), float(low), float(high), block, reliable)


@dataclass(frozen=True, slots=True)
class PairedRanking:
    """Several estimates over the same moments, the smallest RMSE first."""

    rmse: Mapping[str, float]
    """in rising order"""
    behind: Mapping[str, RmseDifference]
    """of all but the first: its RMSE less that of the first; value >= 0 where both are finite"""
    moments: int
    """at which all of them have an error"""


def paired_ranking(errors: Mapping[str, ArrayLike], *, seed: int = 0) -> PairedRanking:
    """Ranks errors (n,) at the same n moments by their RMSE over those at which none of them is NaN.

    `behind` says for each whether it is settled that the first one is smaller: see `rmse_difference`. Raises InputError
    where they are not of one length.
    """
    columns = {name: np.asarray(e, dtype=np.float64) for name, e in errors.items()}
    if len({column.shape for column in columns.values()}) > 1:
        raise InputError("errors at the same moments are needed, got some of different lengths")
    everywhere = ~np.any([np.isnan(column) for column in columns.values()], axis=0)
    common = {name: column[everywhere] for name, column in columns.items()} if columns else {}
    if not any(len(column) for column in common.values()):
        return PairedRanking({}, {}, 0)
    rmse = {name: float(np.sqrt(np.mean(column**2))) for name, column in common.items()}
    order = sorted(rmse, key=lambda name: rmse[name])
    first = common[order[0]]
    behind = {name: rmse_difference(common[name], first, seed=seed) for name in order[1:]}
    return PairedRanking({name: rmse[name] for name in order}, behind, int(np.sum(everywhere)))
