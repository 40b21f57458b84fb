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

    The bounds assume independent runs (other noise, other seeds) and Gaussian errors. They are those of a single frame.
    Errors of frames are correlated, and the mean of `anees` over frames scatters at most as much as one frame: it lies
    inside these bounds with a probability of about 95 % or more. Runs may differ in length.
    """
    return average_nees([nees(estimate, truth) for estimate, truth in runs])


def average_nees(columns: Sequence[FloatArray], degrees: int = POSE_DEGREES) -> pd.DataFrame:
    """Average over runs of their NEES (T,), which has `degrees` degrees of freedom; for the columns see `anees`."""
    frames = max((len(values) for values in columns), default=0)
    values = np.full((len(columns), frames), np.nan)
    for row, column in zip(values, columns, strict=True):
        row[: len(column)] = column
    n = (~np.isnan(values)).sum(axis=0)
    total = np.nansum(values, axis=0)
    divisor = np.maximum(n, 1)
    low, high = chi_square_bounds(float(degrees), divisor)
    table = pd.DataFrame(
        {"anees": total / divisor, "runs": n, "low": low, "high": high}, index=pd.RangeIndex(frames, name="frame")
    )
    table.loc[n == 0, ["anees", "low", "high"]] = np.nan
    return table


class AneesSummary(NamedTuple):
    """ANEES over all frames of several runs, with its chi-square bounds."""

    anees: float
    low: float
    high: float
    """95 % bounds of the average over the runs at a single frame; see `anees`"""
    inside: float
    """share of the frames whose average over the runs lies inside its bounds (expected 0.95)"""
    runs: int

    @property
    def verdict(self) -> str:
        """`consistent` inside the bounds, `overconfident` above and `conservative` below; empty without a NEES."""
        if np.isnan(self.anees):
            return ""
        if self.anees > self.high:
            return "overconfident"
        return "conservative" if self.anees < self.low else "consistent"


def anees_summary(columns: Sequence[FloatArray]) -> AneesSummary:
    """ANEES over all frames from the NEES (T,) of each run; NaN without a NEES."""
    known = [values for values in columns if not np.isnan(values).all()]
    table = average_nees(known)
    table = table[table["runs"] == len(known)] if known else table
    if len(table) == 0:
        return AneesSummary(np.nan, np.nan, np.nan, np.nan, len(known))
    inside = (table["anees"] >= table["low"]) & (table["anees"] <= table["high"])
    low, high = chi_square_bounds(float(POSE_DEGREES), len(known))
    return AneesSummary(float(table["anees"].mean()), float(low), float(high), float(inside.mean()), len(known))
