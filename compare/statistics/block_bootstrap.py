"""Moving-block bootstrap (Kunsch, 1989) for statistics of errors that are correlated in time.

The block length is that of Politis and White (2004). Sums and quantiles are computed without writing the draws out.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, InputError

from .descriptive import mean, quantile, without_nan

REPETITIONS = 1000
CONFIDENCE = 0.95
MIN_BLOCKS = 10
"""blocks in a series below which an interval is not reliable"""
MAX_BLOCKS = 5000
"""blocks in a series at most; longer blocks than the correlation requires do no harm at this number"""

OF_SERIES = ("rmse", "mean", "median", "std", "p95")
WITHOUT_INTERVAL = ("min", "max", "sse")
"""the bootstrap is not consistent for extremes, and a sum grows with the number of errors"""
AT_ONCE = 500_000
"""numbers per batch: few enough to stay in the processor's cache"""
INSIGNIFICANT_IN_A_ROW = 5


class BlockLength(NamedTuple):
    """Length of the blocks of a bootstrap, in values."""

    length: int
    correlation_ends: bool
    """whether the autocorrelation vanishes within the lags examined; False for trends and drift"""


def block_length(values: FloatArray) -> BlockLength:
    """Block length (1 to n/3) for a moving-block bootstrap of the mean of values (n,), from their autocorrelation.

    Politis and White (2004), as corrected by Patton, Politis and White (2009): the lag m after which five
    autocorrelations or more in a row are insignificant (|rho| < 2 sqrt(log10(n) / n)), a flat-top window of twice that
    width, and b = (3 G^2 / (2 g^2))^(1/3) n^(1/3), with g the spectral density at zero (the sum of the
    autocovariances) and G the same sum weighted by |lag|. Where no such lag comes within about sqrt(n), it is the
    longest that is allowed, 3 sqrt(n).
    """
    n = len(values)
    longest = max(1, int(np.ceil(min(3.0 * np.sqrt(n), n / 3.0))))
    if n < 2 * INSIGNIFICANT_IN_A_ROW or np.ptp(values) == 0.0:
        return BlockLength(1, True)
    in_a_row = max(INSIGNIFICANT_IN_A_ROW, int(np.ceil(np.sqrt(np.log10(n)))))
    widest = min(int(np.ceil(np.sqrt(n))) + in_a_row, n - 1)
    covariance = autocovariance(values)[: widest + 1]
    significant = np.abs(covariance[1:] / covariance[0]) >= 2.0 * np.sqrt(np.log10(n) / n)
    last = _last_before_quiet(significant, in_a_row)
    if last is None:
        return BlockLength(longest, False)
    window = min(2 * max(last, 1), widest)
    lag = np.arange(window + 1)
    weighted = np.clip(2.0 * (1.0 - lag / window), 0.0, 1.0) * covariance[: window + 1]
    density = weighted[0] + 2.0 * weighted[1:].sum()
    slope = 2.0 * float(lag @ weighted)
    if density <= 0.0:
        return BlockLength(1, True)
    length = (1.5 * (slope / density) ** 2 * n) ** (1.0 / 3.0)
    return BlockLength(int(np.clip(np.ceil(length), 1, longest)), True)


def autocovariance(values: FloatArray) -> FloatArray:
    """Autocovariances (n,) of values (n,) at lags 0 to n - 1, each divided by n; by Fourier transform."""
    n = len(values)
    spectrum = np.fft.rfft(values - values.mean(), 2 * n)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, 2 * n)[:n] / n)


def _last_before_quiet(significant: BoolArray, in_a_row: int) -> int | None:
    """Lag after which `in_a_row` consecutive lags are insignificant; None where there is none."""
    quiet_so_far = np.cumsum(np.concatenate([[0], ~significant]))
    quiet = quiet_so_far[in_a_row:] - quiet_so_far[:-in_a_row] == in_a_row
    return int(np.argmax(quiet)) if quiet.any() else None


@dataclass(frozen=True, eq=False, slots=True)
class BlockDraws:
    """Draws of r series of n values each: blocks of a series that begin anywhere; the last one is truncated."""

    start: IntArray
    """start of each block (r, m)"""
    length: IntArray
    """length of each block (m,), n in total"""

    def __len__(self) -> int:
        return len(self.start)

    @property
    def n(self) -> int:
        """Number of values of a series."""
        return int(self.length.sum())

    def sums(self, values: FloatArray) -> FloatArray:
        """Sums (r, d) of values (n, d) over each drawn series."""
        before = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
        total = np.empty((len(self), values.shape[1]))
        for rows in _batches(len(self), len(self.length)):
            start = self.start[rows]
            total[rows] = (before[start + self.length] - before[start]).sum(axis=1)
        return total

    def quantiles(self, values: FloatArray, at: tuple[float, ...]) -> FloatArray:
        """Quantiles (r, q) `at` (0 to 1) of values (n,) in each drawn series, linear between ranks as numpy's."""
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
        """Multiplicity (rows, n) of each value in the drawn series."""
        start, width = self.start[rows], self.n + 1
        first = width * np.arange(len(start))[:, None]
        change = np.zeros(width * len(start), dtype=np.int32)
        np.add.at(change, (first + start).ravel(), np.int32(1))
        np.subtract.at(change, (first + start + self.length).ravel(), np.int32(1))
        return np.cumsum(change.reshape(-1, width)[:, :-1], axis=1, dtype=np.int32)


def draw_blocks(n: int, block: int, repetitions: int, seed: int) -> BlockDraws:
    """Draw `repetitions` series of n values from blocks of `block` (1 to n) values."""
    whole, rest = divmod(n, block)
    length = np.array([block] * whole + [rest] * (rest > 0), dtype=np.int64)
    start = np.random.default_rng(seed).integers(0, n - block + 1, size=(repetitions, len(length)))
    return BlockDraws(start, length)


def _batches(rows: int, width: int) -> list[slice]:
    step = max(1, AT_ONCE // max(width, 1))
    return [slice(k, min(k + step, rows)) for k in range(0, rows, step)]


def error_statistics(
    errors: ArrayLike,
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
    block: int | None = None,
) -> pd.DataFrame:
    """Statistics of errors (n,) in order of time, with bootstrap intervals: columns `value`, `low`, `high`.

    Rows: rmse, mean, median, std, p95, min, max, sse (sum of squares) and n. `low` and `high` are percentiles over
    `repetitions` series of random blocks of the errors, which preserves their correlation in time; NaN
    for min, max, sse and n. `block` is by default the longer of Politis and White's for the errors and their squares,
    and no less than n / MAX_BLOCKS. The table's `attrs` have `block`, `blocks` (the number that fits into the series),
    `confidence` and `reliable`: whether there are MIN_BLOCKS of them and the correlation ends within the series,
    which that of an error that grows with the path does not; `missing`, the number of NaN. Infinite errors count,
    and leave no interval. All NaN where there is no error. Raises
    InputError for a confidence outside (0, 1), fewer than 1 repetition, or a block that is not between 1 and n.
    """
    if not 0.0 < confidence < 1.0 or repetitions < 1:
        raise InputError(f"bootstrap: expected 0 < confidence < 1 and repetitions, got {confidence!r}, {repetitions!r}")
    e = without_nan(errors)
    n = len(e)
    finite = bool(np.isfinite(e).all())
    if block is not None and not 1 <= block <= max(n, 1):
        raise InputError(f"bootstrap: a block of {block} does not fit into {n} errors")
    found = [block_length(e), block_length(e**2)] if n and finite else []
    length = block or max([1, -(-n // MAX_BLOCKS), *(one.length for one in found)])
    values = {**_of_series(e), "n": n}
    table = pd.DataFrame({"value": values, "low": np.nan, "high": np.nan}).rename_axis("statistic")
    if n > 1 and finite:
        drawn = _of_draws(e, draw_blocks(n, length, repetitions, seed))
        table.loc[list(OF_SERIES), ["low", "high"]] = percentile_interval(drawn, confidence).T
    table.attrs = {
        "block": length,
        "blocks": n / length,
        "confidence": confidence,
        "reliable": finite and n / length >= MIN_BLOCKS and all(one.correlation_ends for one in found),
        "missing": int(np.size(np.asarray(errors)) - n),
    }
    return table


def percentile_interval(drawn: FloatArray, confidence: float = CONFIDENCE) -> FloatArray:
    """Percentile interval (2, d), low and high, of drawn statistics (r, d)."""
    return np.asarray(np.percentile(drawn, [50.0 * (1.0 - confidence), 50.0 * (1.0 + confidence)], axis=0))


def _of_series(e: FloatArray) -> dict[str, float]:
    if len(e) == 0:
        return dict.fromkeys((*OF_SERIES, *WITHOUT_INTERVAL), float("nan"))
    spread = e.std() if np.isfinite(e).all() else np.inf
    median, p95 = quantile(e, 0.5), quantile(e, 0.95)
    figures = (np.sqrt(np.mean(e**2)), mean(e), median, spread, p95, e.min(), e.max(), np.sum(e**2))
    return dict(zip((*OF_SERIES, *WITHOUT_INTERVAL), map(float, figures), strict=True))


def _of_draws(e: FloatArray, draws: BlockDraws) -> FloatArray:
    """Statistics OF_SERIES (r, 5) of each series drawn from e (n,)."""
    centre = e.mean()
    square, apart, square_apart = (draws.sums(np.stack([e**2, e - centre, (e - centre) ** 2], axis=1)) / len(e)).T
    median, p95 = draws.quantiles(e, (0.5, 0.95)).T
    deviation = np.sqrt(np.maximum(square_apart - apart**2, 0.0))
    return np.stack([np.sqrt(square), centre + apart, median, deviation, p95], axis=1)
