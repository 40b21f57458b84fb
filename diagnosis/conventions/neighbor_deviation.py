"""Jumps of single velocity samples away from their neighbors."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fgbaseline.geometry import FloatArray

NEIGHBORS = 5
"""samples to either side, from whose median a sample jumps: so many jumps in succession are still found"""
FAR_BLIND = 100.0
"""median differences from which on a jump is none of the motion, whatever the cameras see"""
FLOOR = 0.01
"""share of the usual size of the velocity, below which no difference counts as the median one"""
TINY = 1e-3
"""m/s or rad/s, the same at rest"""


def among_neighbors(recorded: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The median (n, 3) of the samples around each of n, itself included, and its distance (n,) from it by `far`."""
    padded = np.pad(recorded, ((NEIGHBORS, NEIGHBORS), (0, 0)), mode="symmetric")
    usual = np.median(sliding_window_view(padded, 2 * NEIGHBORS + 1, axis=0), axis=2)
    return usual, far(np.linalg.norm(recorded - usual, axis=1), recorded)


def far(difference: FloatArray, recorded: FloatArray) -> FloatArray:
    """Distances (n,) between velocities, over their median or a share of `recorded` (n, 3); NaN where unknown."""
    usual = float(np.quantile(np.linalg.norm(recorded, axis=1), 0.9))
    return np.asarray(difference / max(float(np.nanmedian(difference)), FLOOR * usual, TINY), dtype=np.float64)
