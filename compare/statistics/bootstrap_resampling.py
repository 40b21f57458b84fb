"""Draws of a moving-block bootstrap: sums and quantiles of the drawn series, which are not stored."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray

CONFIDENCE = 0.95
AT_ONCE = 500_000
"""numbers per batch: few enough to stay in the processor's cache"""
FEW = 8
"""number of remaining draws at which the search for a rank ends; the quantile of each is then computed"""


@dataclass(frozen=True, eq=False, slots=True)
class BlockDraws:
    """Draws of r series of n values each, of blocks with random starts; the last block is truncated."""

    start: IntArray
    """start of each block (r, m)"""
    length: IntArray
    """length of each block (m,), n in total; all but the last are equal"""

    def __len__(self) -> int:
        return len(self.start)

    @property
    def n(self) -> int:
        """Number of values of a series."""
        return int(self.length.sum())

    def sums(self, values: FloatArray) -> FloatArray:
        """Sums (r, d) of values (n, d) over each drawn series."""
        return np.stack([self._sums(column) for column in values.T], axis=1)

    def means(self, values: FloatArray) -> FloatArray:
        """Means (r,) of values (n,) in each drawn series."""
        return self._sums(values) / self.n

    def counts(self, chosen: BoolArray, draws: IntArray | None = None) -> IntArray:
        """Number (r,) of values of the mask `chosen` (n,) in each drawn series, or (k,) in the series `draws` (k,)."""
        return self._sums(chosen.astype(np.int32), draws).astype(np.int64)

    def quantiles(self, values: FloatArray, at: tuple[float, ...]) -> FloatArray:
        """Quantiles (r, q) `at` (0 to 1) of values (n,) in each drawn series, linear between ranks as numpy's."""
        n, order = self.n, np.argsort(values, kind="stable")
        rising = values[order]
        rank = np.asarray(at) * (n - 1)
        low = np.floor(rank).astype(np.int64)
        ranks, share = np.stack([low, np.minimum(low + 1, n - 1)]), rank - low
        found = np.empty((len(self), len(at)))
        for rows in _batches(len(self), n):
            up_to = np.cumsum(np.take(self._multiplicity(rows), order, axis=1), axis=1, dtype=np.int32)
            for row, rises in zip(range(rows.start, rows.stop), up_to, strict=True):
                here, there = rising[np.searchsorted(rises, ranks.astype(np.int32), side="right")]
                found[row] = here + share * (there - here)
        return found

    def quantile_interval(self, values: FloatArray, at: float, confidence: float = CONFIDENCE) -> FloatArray:
        """Percentile interval (2,), low and high, of the quantile `at` of values (n,): see `quantiles`.

        Equal to `percentile_interval` of all r quantiles. Only those next to its bounds are computed: the number of
        values below a threshold shows on which side of it the quantile of a series lies.
        """
        r, rising = len(self), np.sort(values)
        first = int(np.floor(at * (self.n - 1)))
        counts = self.counts(values <= rising[first])
        bounds = []
        for rank in (np.array([0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence]) * (r - 1)).tolist():
            near, below = self._near(values, rising, first, counts, int(rank))
            found = np.sort(replace(self, start=self.start[near]).quantiles(values, (at,))[:, 0])
            here, there = found[int(rank) - below], found[min(int(rank) + 1, r - 1) - below]
            bounds.append(here + (rank - int(rank)) * (there - here))
        return np.array(bounds)

    def _near(
        self, values: FloatArray, rising: FloatArray, first: int, counts: IntArray, rank: int
    ) -> tuple[IntArray, int]:
        """Draws that include those of `rank` and `rank` + 1 (0 to r - 1) by their quantiles, and the number below them.

        The quantile of a series lies between its values of ranks `first` and `first` + 1. The number of values below a
        threshold shows in which series the quantile may be below it, and in which it surely is. If at most `rank` may
        be below, the sure ones are excluded from below; if `rank` + 2 surely are, the others are excluded from above.
        The first threshold is `rising[first]`, with the `counts` (r,); the next two are around Bahadur's (1966) linear
        guess; then the thresholds bisect.
        """
        guess, margin = int(np.sort(2 * first - counts)[rank]), 1 + int(counts.std() / 20.0)
        trials = [guess - margin, guess + margin]
        near, below, low, high, middle = np.arange(len(self)), 0, -1, self.n - 1, first
        bisecting = False
        while True:
            perhaps, surely = counts > first, counts >= min(first + 2, self.n)
            if below + perhaps.sum() <= rank:
                near, below, low = near[~surely], below + int(surely.sum()), middle
            elif below + surely.sum() >= min(rank + 2, len(self)):
                near, high = near[perhaps], middle
            elif bisecting:
                return near, below
            bisecting = not trials
            if len(near) <= FEW or high - low < 2:
                return near, below
            middle = (low + high) // 2 if bisecting else min(max(trials.pop(), low + 1), high - 1)
            counts = self.counts(values <= rising[middle], near)

    def _sums(self, values: NDArray[np.float64] | NDArray[np.int32], draws: IntArray | None = None) -> FloatArray:
        before = np.concatenate([np.zeros(1, values.dtype), np.cumsum(values, dtype=values.dtype)])
        block, rest = int(self.length[0]), int(self.length[-1])
        of_block, of_rest = before[block:] - before[:-block], before[rest:] - before[:-rest]
        total = np.empty(len(self) if draws is None else len(draws))
        for rows in _batches(len(total), len(self.length)):
            start = self.start[rows if draws is None else draws[rows]]
            total[rows] = of_block[start[:, :-1]].sum(axis=1) + of_rest[start[:, -1]]
        return total

    def _multiplicity(self, rows: slice) -> NDArray[np.int32]:
        """Multiplicity (rows, n) of each value in the drawn series."""
        start, width = self.start[rows], self.n + 1
        first = width * np.arange(len(start))[:, None]
        change = np.bincount((first + start).ravel(), minlength=width * len(start))
        change -= np.bincount((first + start + self.length).ravel(), minlength=width * len(start))
        return np.cumsum(change.reshape(-1, width)[:, :-1], axis=1, dtype=np.int32)


def draw_blocks(n: int, block: int, repetitions: int, seed: int) -> BlockDraws:
    """Draw `repetitions` series of n values from blocks of `block` (1 to n) values."""
    whole, rest = divmod(n, block)
    length = np.array([block] * whole + [rest] * (rest > 0), dtype=np.int64)
    start = np.random.default_rng(seed).integers(0, n - block + 1, size=(repetitions, len(length)))
    return BlockDraws(start, length)


def percentile_interval(drawn: FloatArray, confidence: float = CONFIDENCE) -> FloatArray:
    """Percentile interval (2, d), low and high, of drawn statistics (r, d)."""
    return np.asarray(np.percentile(drawn, [50.0 * (1.0 - confidence), 50.0 * (1.0 + confidence)], axis=0))


def _batches(rows: int, width: int) -> Iterator[slice]:
    step = max(1, AT_ONCE // max(width, 1))
    return (slice(k, min(k + step, rows)) for k in range(0, rows, step))
