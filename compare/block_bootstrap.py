"""How sure a statistic of errors is that follow each other in time: moving-block bootstrap (Kunsch, 1989)."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, InputError

from .block_length import block_length

REPETITIONS = 1000
CONFIDENCE = 0.95
FEWEST_BLOCKS = 10
"""with fewer, an interval says little: half of the series decides it"""
AT_ONCE = 4_000_000
"""numbers drawn at a time, to bound the memory"""

OF_SERIES = ("rmse", "mean", "median", "std", "p95")
WITHOUT_INTERVAL = ("min", "max", "sse")
"""the bootstrap says nothing true of extremes, and a sum grows with the number of errors"""


def error_statistics(
    errors: ArrayLike,
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
    block: int | None = None,
) -> pd.DataFrame:
    """`value`, `low`, `high` of each statistic of the finite errors (n,), which follow each other in time.

    Rows: rmse, mean, median, std, p95, min, max, sse (sum of squares) and n. `low` and `high` are percentiles over
    `repetitions` series put together from random blocks of the errors, so that their correlation in time counts; NaN
    for min, max, sse and n. `block` is by default the longer of Politis and White's for the errors and their squares.
    The table's `attrs` have `block`, `blocks` (how many fit into the series), `confidence` and `reliable`: whether
    there are FEWEST_BLOCKS of them and the correlation ends within the series, which that of an error that grows with
    the path does not. All NaN where there is no error. Raises InputError for a confidence outside (0, 1), fewer than 1
    repetition, or a block that is not between 1 and n.
    """
    if not 0.0 < confidence < 1.0 or repetitions < 1:
        raise InputError(f"bootstrap: expected 0 < confidence < 1 and repetitions, got {confidence!r}, {repetitions!r}")
    e = np.asarray(errors, dtype=np.float64)
    e = e[np.isfinite(e)]
    n = len(e)
    if block is not None and not 1 <= block <= max(n, 1):
        raise InputError(f"bootstrap: a block of {block} does not fit into {n} errors")
    found = [block_length(e), block_length(e**2)] if n else []
    length = block or max((one.length for one in found), default=1)
    values = {**_of_series(e), "n": n}
    table = pd.DataFrame({"value": values, "low": np.nan, "high": np.nan}).rename_axis("statistic")
    if n > 1:
        drawn = _resampled(e, length, repetitions, np.random.default_rng(seed))
        tails = np.percentile(drawn, [50.0 * (1.0 - confidence), 50.0 * (1.0 + confidence)], axis=0)
        table.loc[list(OF_SERIES), ["low", "high"]] = tails.T
    table.attrs = {
        "block": length,
        "blocks": n / length,
        "confidence": confidence,
        "reliable": n / length >= FEWEST_BLOCKS and all(one.correlation_ends for one in found),
    }
    return table


def _of_series(e: FloatArray) -> dict[str, float]:
    if len(e) == 0:
        return dict.fromkeys((*OF_SERIES, *WITHOUT_INTERVAL), float("nan"))
    with_interval = dict(zip(OF_SERIES, _statistics_of_rows(e[None])[0].tolist(), strict=True))
    return {**with_interval, "min": float(e.min()), "max": float(e.max()), "sse": float(e @ e)}


def _statistics_of_rows(rows: FloatArray) -> FloatArray:
    """(r, 5) the statistics OF_SERIES of each row of (r, n)."""
    median, p95 = np.percentile(rows, [50.0, 95.0], axis=1)
    return np.stack([np.sqrt(np.mean(rows**2, axis=1)), rows.mean(axis=1), median, rows.std(axis=1), p95], axis=1)


def _resampled(e: FloatArray, block: int, repetitions: int, random: np.random.Generator) -> FloatArray:
    """(repetitions, 5) statistics of series as long as e (n,), each put together from blocks at random places."""
    return np.concatenate([_statistics_of_rows(e[index]) for index in _draws(len(e), block, repetitions, random)])


def _draws(n: int, block: int, repetitions: int, random: np.random.Generator) -> Iterator[IntArray]:
    """Indices (r, n) in batches: of blocks that begin anywhere, the last one cut to fit."""
    n_blocks = -(-n // block)
    batch = max(1, AT_ONCE // n)
    for done in range(0, repetitions, batch):
        start = random.integers(0, n - block + 1, size=(min(batch, repetitions - done), n_blocks))
        yield (start[:, :, None] + np.arange(block)).reshape(len(start), -1)[:, :n]
