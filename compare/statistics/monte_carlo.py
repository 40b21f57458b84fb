"""Statistics over independent Monte-Carlo runs (other seeds, other noise): means and rankings with intervals.

Intervals are Student's t at 95 %. They assume independent runs and a nearly Gaussian mean, which holds from about
five runs on unless single runs are outliers.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from fgbaseline.geometry import FloatArray

from .chi_square import PROBABILITY
from .paired_bootstrap import is_level


class MeanInterval(NamedTuple):
    """Mean and its 95 % interval, NaN for a single value."""

    value: float
    low: float
    high: float
    n: int
    """number of values"""


def mean_interval(values: FloatArray) -> MeanInterval:
    """Mean of values (n,) over runs with the interval x +- t s / sqrt(n), t with n - 1 degrees of freedom.

    NaN values are left out. An infinite value makes the mean infinite, without an interval.
    """
    known = values[~np.isnan(values)]
    n = len(known)
    if n == 0:
        return MeanInterval(np.nan, np.nan, np.nan, 0)
    mean = float(np.mean(known))
    if n == 1 or not np.isfinite(known).all():
        return MeanInterval(mean, np.nan, np.nan, n)
    half = float(stdtrit(n - 1, 0.5 + PROBABILITY / 2.0)) * float(np.std(known, ddof=1)) / np.sqrt(n)
    return MeanInterval(mean, mean - half, mean + half, n)


def monte_carlo_ranking(errors: pd.DataFrame) -> pd.DataFrame:
    """Rank estimators (columns) by mean error over runs (rows), smallest first; NaN for a run without an answer.

    Columns `rank`, `runs` with an answer, `mean`, `low`, `high`, and the mean paired difference from the best one
    `behind`, `behind_low`, `behind_high` over the runs that both answered. `tied` where that interval is not above
    zero, as for a single run, which has no interval, or where the mean over these runs is at most 1 % larger (see
    `is_level`). An estimator with fewer answers ranks behind all with more, whatever its mean, since failures are more
    frequent on hard runs; its `behind` can be negative. Estimators with equally many answers are averaged over the runs
    that all of them answered, so that order and `behind` agree; where there is no such run, `behind` of those with as
    many answers as the first is NaN, and they are tied.
    """
    columns = ["rank", "runs", "mean", "low", "high", "behind", "behind_low", "behind_high", "tied"]
    values = {str(name): errors[name].to_numpy(dtype=np.float64) for name in errors}
    answers = {name: int((~np.isnan(value)).sum()) for name, value in values.items()}
    unpaired = set[int]()
    for n in set(answers.values()) - {0}:
        alike = [name for name in values if answers[name] == n]
        common = ~np.isnan([values[name] for name in alike]).any(axis=0)
        if common.any():
            values |= {name: np.where(common, values[name], np.nan) for name in alike}
        else:
            unpaired.add(n)
    means = {name: mean_interval(value) for name, value in values.items()}
    order = sorted((name for name in values if answers[name]), key=lambda name: (-answers[name], means[name].value))
    rows = []
    for rank, name in enumerate(order, 1):
        own, first = values[name], values[order[0]]
        with np.errstate(invalid="ignore"):
            apart = np.where(own == first, 0.0, own - first)
        if answers[name] == answers[order[0]] and answers[name] in unpaired and rank > 1:
            apart = np.full_like(apart, np.nan)
        behind = mean_interval(apart)
        infinite = behind.value == np.inf and behind.n > 1
        smaller = mean_interval(np.where(np.isnan(own), np.nan, first)).value
        tied = rank == 1 or not (behind.low > 0.0 or infinite) or is_level(smaller + behind.value, smaller)
        mean = means[name]
        rows.append((rank, answers[name], mean.value, mean.low, mean.high, behind.value, behind.low, behind.high, tied))
    return pd.DataFrame(rows, columns=columns, index=pd.Index(order, name="estimator"))
