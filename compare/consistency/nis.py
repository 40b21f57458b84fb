"""Normalized innovation squared (NIS) of a filter, with its chi-square bounds."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Estimate
from fgbaseline.geometry import FloatArray

from ..statistics.chi_square import chi_square_bounds, share_inside_bounds


@dataclass(frozen=True, slots=True)
class NisSummary:
    """NIS of a run with its chi-square bounds; NaN where the filter records none."""

    per_degree: float
    """sum of the NIS over the sum of its degrees of freedom (expected 1)"""
    low: float
    high: float
    """95 % bounds of `per_degree` for innovations independent between frames, as those of a consistent filter"""
    inside_95: float
    """share of the frames whose NIS lies inside its own 95 % bounds (expected 0.95)"""
    frames: int


def nis_per_degree(estimate: Estimate) -> FloatArray:
    """NIS over its degrees of freedom (T,), expected 1; NaN where the filter records none."""
    T, recorded = len(estimate.world_T_imu), estimate.innovations
    if recorded is None:
        return np.full(T, np.nan)
    return np.where(recorded.degrees > 0, recorded.nis / np.maximum(recorded.degrees, 1), np.nan)


def nis_summary(estimate: Estimate) -> NisSummary:
    """Summary over the frames in which the filter records a NIS, finite or not."""
    recorded = estimate.innovations
    known = ~np.isnan(nis_per_degree(estimate))
    if recorded is None or not known.any():
        nan = float("nan")
        return NisSummary(nan, nan, nan, nan, 0)
    nis, degrees = recorded.nis[known], recorded.degrees[known].astype(np.float64)
    total = float(degrees.sum())
    low, high = chi_square_bounds(total)
    return NisSummary(
        per_degree=float(nis.sum()) / total,
        low=float(low) / total,
        high=float(high) / total,
        inside_95=share_inside_bounds(nis, degrees),
        frames=int(known.sum()),
    )
