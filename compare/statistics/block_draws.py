"""Series put together from random blocks of a series, and their sums and quantiles without writing them out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray

AT_ONCE = 500_000
"""numbers looked at together: few enough to stay in a processor's cache"""


@dataclass(frozen=True, eq=False, slots=True)
class BlockDraws:
    """r series of n values each, of blocks of a series of n that begin anywhere; the last one is cut to fit."""

    start: IntArray
    """(r, m) where each block begins"""
    length: IntArray
    """(m,) how many values of each are taken; together n"""

    def __len__(self) -> int:
        return len(self.start)

    @property
    def n(self) -> int:
        """Values of a series."""
        return int(self.length.sum())

    def sums(self, values: FloatArray) -> FloatArray:
        """(r, d) the sum over each drawn series of values (n, d)."""
        before = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
        total = np.empty((len(self), values.shape[1]))
        for rows in _batches(len(self), len(self.length)):
            start = self.start[rows]
            total[rows] = (before[start + self.length] - before[start]).sum(axis=1)
        return total

    def quantiles(self, values: FloatArray, at: tuple[float, ...]) -> FloatArray:
        """(r, q) quantiles `at` (0 to 1) of each drawn series of values (n,), linear between ranks as numpy's."""
        n, order = self.n, np.argsort(values, kind="stable")
        rising = values[order]
        rank = np.asarray(at) * (n - 1)
        low = np.floor(rank).astype(np.int64)
        ranks, share = np.stack([low, np.minimum(low + 1, n - 1)]), rank - low
        found = np.empty((len(self), len(at)))
        for rows in _batches(len(self), n):
            up_to = np.cumsum(np.take(self._counts(rows), order, axis=1), axis=1, dtype=np.int32)
            for row, rises in zip(range(rows.start, rows.stop), up_to, strict=True):
                here, there = rising[np.searchsorted(rises, ranks.astype(np.int32), side="right")]
                found[row] = here + share * (there - here)
        return found

    def _counts(self, rows: slice) -> NDArray[np.int32]:
        """(rows, n) how often each value of the series is drawn."""
        start, width = self.start[rows], self.n + 1
        first = width * np.arange(len(start))[:, None]
        change = np.zeros(width * len(start), dtype=np.int32)
        np.add.at(change, (first + start).ravel(), np.int32(1))
        np.subtract.at(change, (first + start + self.length).ravel(), np.int32(1))
        return np.cumsum(change.reshape(-1, width)[:, :-1], axis=1, dtype=np.int32)


def draw_blocks(n: int, block: int, repetitions: int, seed: int) -> BlockDraws:
    """`repetitions` series of n values from blocks of `block` (1 to n) values."""
    whole, rest = divmod(n, block)
    length = np.array([block] * whole + [rest] * (rest > 0), dtype=np.int64)
    start = np.random.default_rng(seed).integers(0, n - block + 1, size=(repetitions, len(length)))
    return BlockDraws(start, length)


def _batches(rows: int, width: int) -> list[slice]:
    step = max(1, AT_ONCE // max(width, 1))
    return [slice(k, min(k + step, rows)) for k in range(0, rows, step)]
