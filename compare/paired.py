"""Which of two estimates is nearer, and whether this recording can tell: both drawn with the same blocks."""

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

    Both have to be of the same moments, in order; moments where either is not finite are left out. Each repetition
    draws the same blocks of moments for both, so that what makes a stretch hard for both does not blur which is better:
    intervals of the two RMSEs can overlap and the order be clear all the same. The block length is Politis and White's
    for the differences of the squared errors. Raises InputError where they are not of one length.
    """
    pair = [np.asarray(e, dtype=np.float64) for e in (errors, others)]
    if pair[0].shape != pair[1].shape or pair[0].ndim != 1:
        raise InputError(f"errors at the same moments are needed, got {pair[0].shape} and {pair[1].shape} of them")
    squares: FloatArray = np.stack(pair, axis=1) ** 2
    squares = squares[np.isfinite(squares).all(axis=1)]
    n = len(squares)
    if n == 0:
        return RmseDifference(np.nan, np.nan, np.nan, 1, False)
    found = block_length(squares[:, 0] - squares[:, 1])
    block = max(found.length, -(-n // MOST_BLOCKS))
    drawn = np.sqrt(draw_blocks(n, block, repetitions, seed).sums(squares) / n)
    low, high = tails(drawn[:, :1] - drawn[:, 1:], confidence)[:, 0]
    first, second = np.sqrt(squares.mean(axis=0))
    reliable = n / block >= FEWEST_BLOCKS and found.correlation_ends
    return RmseDifference(float(first - second), float(low), float(high), block, reliable)
