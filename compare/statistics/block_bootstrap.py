"""How sure a statistic of errors is that follow each other in time: moving-block bootstrap (Kunsch, 1989)."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray, InputError

from .block_draws import BlockDraws, draw_blocks
from .block_length import block_length
from .descriptive import known, mean, quantile

REPETITIONS = 1000
CONFIDENCE = 0.95
FEWEST_BLOCKS = 10
"""with fewer, an interval says little: half of the series decides it"""
MOST_BLOCKS = 5000
"""of a series: blocks that are longer than the correlation asks for do no harm where there are so many"""

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
    """`value`, `low`, `high` of each statistic of the errors (n,), NaN aside, which follow each other in time.

    Rows: rmse, mean, median, std, p95, min, max, sse (sum of squares) and n. `low` and `high` are percentiles over
    `repetitions` series put together from random blocks of the errors, so that their correlation in time counts; NaN
    for min, max, sse and n. `block` is by default the longer of Politis and White's for the errors and their squares,
    and no less than n / MOST_BLOCKS. The table's `attrs` have `block`, `blocks` (how many fit into the series),
    `confidence` and `reliable`: whether there are FEWEST_BLOCKS of them and the correlation ends within the series,
    which that of an error that grows with the path does not; `missing`, how many errors are NaN. Infinite errors count,
    and leave no interval. All NaN where there is no error. Raises
    InputError for a confidence outside (0, 1), fewer than 1 repetition, or a block that is not between 1 and n.
    """
    if not 0.0 < confidence < 1.0 or repetitions < 1:
        raise InputError(f"bootstrap: expected 0 < confidence < 1 and repetitions, got {confidence!r}, {repetitions!r}")
    e = known(errors)
    n = len(e)
    finite = bool(np.isfinite(e).all())
    if block is not None and not 1 <= block <= max(n, 1):
        raise InputError(f"bootstrap: a block of {block} does not fit into {n} errors")
    found = [block_length(e), block_length(e**2)] if n and finite else []
    length = block or max([1, -(-n // MOST_BLOCKS), *(one.length for one in found)])
    values = {**_of_series(e), "n": n}
    table = pd.DataFrame({"value": values, "low": np.nan, "high": np.nan}).rename_axis("statistic")
    if n > 1 and finite:
        drawn = _of_draws(e, draw_blocks(n, length, repetitions, seed))
        table.loc[list(OF_SERIES), ["low", "high"]] = tails(drawn, confidence).T
    table.attrs = {
        "block": length,
        "blocks": n / length,
        "confidence": confidence,
        "reliable": finite and n / length >= FEWEST_BLOCKS and all(one.correlation_ends for one in found),
        "missing": int(np.size(np.asarray(errors)) - n),
    }
    return table


def tails(drawn: FloatArray, confidence: float = CONFIDENCE) -> FloatArray:
    """(2, d) low and high of the percentile interval of drawn figures (r, d)."""
    return np.asarray(np.percentile(drawn, [50.0 * (1.0 - confidence), 50.0 * (1.0 + confidence)], axis=0))


def _of_series(e: FloatArray) -> dict[str, float]:
    if len(e) == 0:
        return dict.fromkeys((*OF_SERIES, *WITHOUT_INTERVAL), float("nan"))
    spread = e.std() if np.isfinite(e).all() else np.inf
    median, p95 = quantile(e, 0.5), quantile(e, 0.95)
    figures = (np.sqrt(np.mean(e**2)), mean(e), median, spread, p95, e.min(), e.max(), np.sum(e**2))
    return dict(zip((*OF_SERIES, *WITHOUT_INTERVAL), map(float, figures), strict=True))


def _of_draws(e: FloatArray, draws: BlockDraws) -> FloatArray:
    """(r, 5) the statistics OF_SERIES of each series drawn from e (n,)."""
    centre = e.mean()
    square, apart, square_apart = (draws.sums(np.stack([e**2, e - centre, (e - centre) ** 2], axis=1)) / len(e)).T
    median, p95 = draws.quantiles(e, (0.5, 0.95)).T
    deviation = np.sqrt(np.maximum(square_apart - apart**2, 0.0))
    return np.stack([np.sqrt(square), centre + apart, median, deviation, p95], axis=1)
