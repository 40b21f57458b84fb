"""Whether a filter's innovations are as large as it expected them."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Estimate
from fgbaseline.geometry import FloatArray

from ..statistics.chi_square import bounds, share_inside


@dataclass(frozen=True, slots=True)
class NisSummary:
    """Innovations of a run beside chi-square; NaN where a filter recorded none."""

    per_degree: float
    """sum of the NIS over the sum of its degrees of freedom: 1 for a filter that knows its errors"""
    low: float
    high: float
    """95 % bounds of `per_degree`, the frames' innovations being independent, as those of a consistent filter are"""
    inside_95: float
    """share of the frames whose NIS lies inside its own 95 % bounds, which assume nothing of other frames"""
    frames: int


def nis_per_degree(estimate: Estimate) -> FloatArray:
    """(T,) NIS over its degrees of freedom, 1 on average; NaN where the filter recorded none."""
    T, recorded = len(estimate.world_T_imu), estimate.innovations
    if recorded is None:
        return np.full(T, np.nan)
    return np.where(recorded.degrees > 0, recorded.nis / np.maximum(recorded.degrees, 1), np.nan)


def nis_summary(estimate: Estimate) -> NisSummary:
    """All frames in which the filter recorded a NIS, be it infinite, at least one landmark being known before."""
    recorded = estimate.innovations
    known = ~np.isnan(nis_per_degree(estimate))
    if recorded is None or not known.any():
        nan = float("nan")
        return NisSummary(nan, nan, nan, nan, 0)
    nis, degrees = recorded.nis[known], recorded.degrees[known].astype(np.float64)
    total = float(degrees.sum())
    low, high = bounds(total)
    return NisSummary(
        per_degree=float(nis.sum()) / total,
        low=float(low) / total,
        high=float(high) / total,
        inside_95=share_inside(nis, degrees),
        frames=int(known.sum()),
    )
