"""Moving-block bootstrap (Kunsch, 1989) for statistics of errors that are correlated in time.

The block length is that of Politis and White (2004).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, InputError

from .bootstrap_resampling import CONFIDENCE, BlockDraws, draw_blocks, percentile_interval
from .descriptive import mean, quantile, without_nan

if TYPE_CHECKING:
    import pandas as pd

REPETITIONS = 1000
MIN_BLOCKS = 10
"""blocks in a series below which an interval is not reliable"""
MAX_BLOCKS = 5000
"""largest number of blocks in a series; with so many, blocks may be longer than the correlation requires"""

OF_SERIES = ("rmse", "mean", "median", "std", "p95")
"""statistics with an interval"""
QUANTILES = {"median": 0.5, "p95": 0.95}
WITHOUT_INTERVAL = ("min", "max", "sse")
"""statistics without an interval: the bootstrap is not consistent for extremes, and a sum grows with n"""
INSIGNIFICANT_IN_A_ROW = 5
"""smallest number of consecutive insignificant lags at which the autocorrelation has ended"""


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


class Bounded(NamedTuple):
    """Statistic with its confidence interval; NaN without one."""

    value: float
    low: float = float("nan")
    high: float = float("nan")


@dataclass(frozen=True, slots=True, repr=False)
class ErrorStatistics(Displayed):
    """Statistics of errors in order of time, with bootstrap intervals of some."""

    by_name: Mapping[str, Bounded]
    """rmse, mean, median, std, p95, min, max, sse (sum of squares) and n"""
    block: int
    """block length, in errors"""
    blocks: float
    """number of blocks that fit into the series"""
    confidence: float
    reliable: bool
    """whether at least MIN_BLOCKS blocks fit and the correlation ends within the series; False for an error that grows
    with the path"""
    missing: int
    """number of NaN"""

    def __getitem__(self, name: str) -> Bounded:
        return self.by_name[name]

    @property
    def table(self) -> "pd.DataFrame":
        """Columns `value`, `low` and `high`, a row for each statistic; the rest is in `attrs`."""
        import pandas as pd

        rows = pd.Index(self.by_name, name="statistic")
        table = pd.DataFrame(list(self.by_name.values()), index=rows, columns=list(Bounded._fields))
        table.attrs = {key: getattr(self, key) for key in ("block", "blocks", "confidence", "reliable", "missing")}
        return table


def error_statistics(
    errors: ArrayLike,
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
    block: int | None = None,
) -> "pd.DataFrame":
    """Table of `bootstrapped` statistics of errors (n,): columns `value`, `low`, `high`.

    Rows: rmse, mean, median, std, p95, min, max, sse (sum of squares) and n. The table's `attrs` have `block`,
    `blocks` (the number that fits into the series), `confidence`, `reliable` and `missing`, the number of NaN.
    """
    return bootstrapped(errors, confidence=confidence, repetitions=repetitions, seed=seed, block=block).table


def bootstrapped(
    errors: ArrayLike,
    *,
    of: Collection[str] = OF_SERIES,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
    block: int | None = None,
) -> ErrorStatistics:
    """Statistics of errors (n,) in order of time, with bootstrap intervals of those named in `of`.

    Intervals are percentiles over `repetitions` series of random blocks of the errors, which preserves their
    correlation in time. `block` is by default the longer of Politis and White's for the errors and their squares,
    and no less than n / MAX_BLOCKS. Infinite errors count in the statistics, which then have no interval. Percentiles
    that do not contain the statistic are no interval either: so few blocks fit that the drawn series do not spread as
    the series does, which happens to the standard deviation. All NaN without an error.
    Raises InputError for a confidence outside (0, 1), fewer than 1 repetition, or a block that is not between 1 and n.
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
    statistics = {name: Bounded(value) for name, value in {**_of_series(e), "n": n}.items()}
    if n > 1 and finite:
        for name, (low, high) in _intervals(e, draw_blocks(n, length, repetitions, seed), confidence, of).items():
            value = statistics[name].value
            if low <= value <= high or np.isclose(value, (low, high), rtol=1e-9, atol=0.0).any():
                statistics[name] = Bounded(value, low, high)
    return ErrorStatistics(
        by_name=statistics,
        block=length,
        blocks=n / length,
        confidence=confidence,
        reliable=finite and n / length >= MIN_BLOCKS and all(one.correlation_ends for one in found),
        missing=int(np.size(np.asarray(errors)) - n),
    )


def _of_series(e: FloatArray) -> dict[str, float]:
    if len(e) == 0:
        return dict.fromkeys((*OF_SERIES, *WITHOUT_INTERVAL), float("nan"))
    spread = e.std() if np.isfinite(e).all() else np.inf
    median, p95 = quantile(e, 0.5), quantile(e, 0.95)
    figures = (np.sqrt(np.mean(e**2)), mean(e), median, spread, p95, e.min(), e.max(), np.sum(e**2))
    return dict(zip((*OF_SERIES, *WITHOUT_INTERVAL), map(float, figures), strict=True))


def _intervals(
    e: FloatArray, draws: BlockDraws, confidence: float, of: Collection[str]
) -> dict[str, tuple[float, float]]:
    """Low and high of the statistics `of` over the series drawn from e (n,)."""
    drawn: dict[str, FloatArray] = {}
    if "rmse" in of:
        drawn["rmse"] = np.sqrt(draws.means(e**2))
    if "mean" in of or "std" in of:
        apart = draws.means(e - e.mean())
        drawn["mean"] = e.mean() + apart
    if "std" in of:
        drawn["std"] = np.sqrt(np.maximum(draws.means((e - e.mean()) ** 2) - apart**2, 0.0))
    found = {name: percentile_interval(each, confidence) for name, each in drawn.items()}
    found |= {name: draws.quantile_interval(e, QUANTILES[name], confidence) for name in QUANTILES if name in of}
    return {name: (float(found[name][0]), float(found[name][1])) for name in of}
