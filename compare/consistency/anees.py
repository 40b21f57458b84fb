"""Figures of several independent runs (other seeds, other noise): their mean, which estimator is best, and how sure.

Intervals are Student's at 95 %: they assume that the runs are independent and the mean nearly Gaussian, which it is
from some five runs on unless single runs are far off.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from fgbaseline.geometry import FloatArray

from ..statistics.chi_square import PROBABILITY, bounds

POSE_DEGREES = 6


class Mean(NamedTuple):
    """A mean and its 95 % interval, NaN where one value alone says nothing of it."""

    value: float
    low: float
    high: float
    n: int
    """values it rests on"""


def mean_of(values: FloatArray) -> Mean:
    """The mean over runs of values (n,), with x +- t s / sqrt(n), t of n - 1 degrees of freedom; NaN is left out.

    An infinite value makes the mean infinite, without an interval.
    """
    known = values[~np.isnan(values)]
    n = len(known)
    if n == 0:
        return Mean(np.nan, np.nan, np.nan, 0)
    mean = float(np.mean(known))
    if n == 1 or not np.isfinite(known).all():
        return Mean(mean, np.nan, np.nan, n)
    half = float(stdtrit(n - 1, 0.5 + PROBABILITY / 2.0)) * float(np.std(known, ddof=1)) / np.sqrt(n)
    return Mean(mean, mean - half, mean + half, n)


def ranking(errors: pd.DataFrame) -> pd.DataFrame:
    """Estimators (columns) over runs (rows) by their mean error, smallest first; NaN for a run without an answer.

    `rank`; `runs` that have an answer; `mean`, `low`, `high`; and, paired run by run with the best one, `behind`,
    `behind_low` and `behind_high`: how much larger the error is on average, over the runs that both answered. `tied`
    where that interval does not lie above zero: these runs do not separate the two, and neither does a single one,
    which has no interval. An estimator with fewer answers ranks behind all with more, whatever its mean: it may have
    failed where it was hard; its `behind` can be negative. Those with equally many answers are ranked and averaged over
    the runs that all of them answered, or their order and `behind` could contradict each other.
    """
    columns = ["rank", "runs", "mean", "low", "high", "behind", "behind_low", "behind_high", "tied"]
    values = {str(name): errors[name].to_numpy(dtype=np.float64) for name in errors}
    answers = {name: int((~np.isnan(value)).sum()) for name, value in values.items()}
    for n in set(answers.values()) - {0}:
        alike = [name for name in values if answers[name] == n]
        common = ~np.isnan([values[name] for name in alike]).any(axis=0)
        if common.any():
            values |= {name: np.where(common, values[name], np.nan) for name in alike}
    means = {name: mean_of(value) for name, value in values.items()}
    order = sorted((name for name in values if answers[name]), key=lambda name: (-answers[name], means[name].value))
    rows = []
    for rank, name in enumerate(order, 1):
        with np.errstate(invalid="ignore"):
            apart = np.where(values[name] == values[order[0]], 0.0, values[name] - values[order[0]])
        behind = mean_of(apart)
        infinite = behind.value == np.inf and behind.n > 1
        tied = rank == 1 or not (behind.low > 0.0 or infinite)
        mean = means[name]
        rows.append((rank, answers[name], mean.value, mean.low, mean.high, behind.value, behind.low, behind.high, tied))
    return pd.DataFrame(rows, columns=columns, index=pd.Index(order, name="estimator"))


def nees_over_runs(columns: Sequence[FloatArray]) -> pd.DataFrame:
    """NEES (T,) of each run, averaged over runs: see `anees`, which this is for estimates."""
    frames = max((len(values) for values in columns), default=0)
    values = np.full((len(columns), frames), np.nan)
    for row, column in zip(values, columns, strict=True):
        row[: len(column)] = column
    n = (~np.isnan(values)).sum(axis=0)
    total = np.nansum(values, axis=0)
    some = np.maximum(n, 1)
    low, high = bounds(float(POSE_DEGREES), some)
    table = pd.DataFrame(
        {"anees": total / some, "runs": n, "low": low, "high": high}, index=pd.RangeIndex(frames, name="frame")
    )
    table.loc[n == 0, ["anees", "low", "high"]] = np.nan
    return table


class Consistency(NamedTuple):
    """ANEES over all frames of several runs, against what chi-square allows."""

    anees: float
    low: float
    high: float
    """bounds of a single frame's average over the runs: errors of neighbouring frames are nearly the same, so that the
    mean over frames scatters as much as one of them at most"""
    inside: float
    """share of the frames whose average over the runs lies inside its bounds: 0.95 is expected"""
    runs: int


def consistency_of(columns: Sequence[FloatArray]) -> Consistency:
    """The consistency of an estimator over runs with NEES (T,) each; NaN where none has any."""
    known = [values for values in columns if not np.isnan(values).all()]
    table = nees_over_runs(known)
    table = table[table["runs"] == len(known)] if known else table
    if len(table) == 0:
        return Consistency(np.nan, np.nan, np.nan, np.nan, len(known))
    inside = (table["anees"] >= table["low"]) & (table["anees"] <= table["high"])
    low, high = bounds(float(POSE_DEGREES), len(known))
    return Consistency(float(table["anees"].mean()), float(low), float(high), float(inside.mean()), len(known))
