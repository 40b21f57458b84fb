"""NEES averaged over Monte-Carlo runs (ANEES) and its chi-square bounds (Bar-Shalom, Li and Kirubarajan, 2001)."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray

from ..statistics.chi_square import chi_square_bounds
from .nees import nees

POSE_DEGREES = 6
"""degrees of freedom of a pose"""


def anees(runs: Iterable[tuple[Estimate, Truth]]) -> pd.DataFrame:
    """NEES averaged over runs, one row per `frame`: `anees`, number of `runs`, and 95 % bounds `low` and `high`.

    The bounds assume independent runs (other noise, other seeds) and Gaussian errors; each frame stands alone. Runs may
    differ in length. The mean of `anees` over frames, whose errors are correlated, lies inside the bounds of a single
    frame with at least about their probability.
    """
    return average_nees([nees(estimate, truth) for estimate, truth in runs])


def average_nees(columns: Sequence[FloatArray], degrees: int = POSE_DEGREES) -> pd.DataFrame:
    """NEES (T,), with these `degrees` of freedom, of each run averaged over runs; for the columns see `anees`."""
    frames = max((len(values) for values in columns), default=0)
    values = np.full((len(columns), frames), np.nan)
    for row, column in zip(values, columns, strict=True):
        row[: len(column)] = column
    n = (~np.isnan(values)).sum(axis=0)
    total = np.nansum(values, axis=0)
    some = np.maximum(n, 1)
    low, high = chi_square_bounds(float(degrees), some)
    table = pd.DataFrame(
        {"anees": total / some, "runs": n, "low": low, "high": high}, index=pd.RangeIndex(frames, name="frame")
    )
    table.loc[n == 0, ["anees", "low", "high"]] = np.nan
    return table


class AneesSummary(NamedTuple):
    """ANEES over all frames of several runs, with its chi-square bounds."""

    anees: float
    low: float
    high: float
    """95 % bounds of a single frame's average over the runs: errors of neighboring frames are correlated, so the mean
    over frames scatters at most as much as one of them"""
    inside: float
    """share of the frames whose average over the runs lies inside its bounds (expected 0.95)"""
    runs: int


def anees_summary(columns: Sequence[FloatArray]) -> AneesSummary:
    """ANEES over all frames from the NEES (T,) of each run; NaN where no run has any."""
    known = [values for values in columns if not np.isnan(values).all()]
    table = average_nees(known)
    table = table[table["runs"] == len(known)] if known else table
    if len(table) == 0:
        return AneesSummary(np.nan, np.nan, np.nan, np.nan, len(known))
    inside = (table["anees"] >= table["low"]) & (table["anees"] <= table["high"])
    low, high = chi_square_bounds(float(POSE_DEGREES), len(known))
    return AneesSummary(float(table["anees"].mean()), float(low), float(high), float(inside.mean()), len(known))
