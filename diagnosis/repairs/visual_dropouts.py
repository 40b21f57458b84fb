"""Velocities over visual dropouts, averaged over neighboring intervals.

The velocity of a body changes little within a few intervals. Where its measurement noise is larger than that change, an
average over neighbors is more accurate. Elsewhere the average would only correlate neighboring increments.
In a dropout the whole path after it depends on a single noisy sample.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fgbaseline.data.observations import BoolArray, IntArray, Observations
from fgbaseline.geometry import FloatArray

from ..odometry.stereo_odometry import MIN_SEGMENTS

MAX_MARGIN = 8
"""intervals to each side"""
MIN_SAMPLES = 20
"""stretches of odometry from which the change of a velocity is estimated"""
LONGEST = 10
"""intervals: the noise of a longer dropout averages out by itself"""


@dataclass(frozen=True, eq=False, slots=True)
class DropoutVelocities:
    """Velocities of all intervals, with their standard deviations."""

    twist: FloatArray
    """(T-1, 6) m/s and rad/s"""
    deviation: FloatArray
    """(T-1, 6) of independent errors of the intervals"""
    blind: IntArray
    """the intervals with averaged velocities"""


def dropout_intervals(observations: Observations, n_frames: int) -> BoolArray:
    """Mask (T-1,) of the intervals whose two frames have too few common landmarks for odometry."""
    order = observations.by_track()
    frame, landmark = observations.frame[order], observations.landmark[order]
    linked = (landmark[:-1] == landmark[1:]) & (frame[:-1] + 1 == frame[1:])
    count = np.bincount(frame[:-1][linked], minlength=n_frames - 1)
    return np.asarray(count < MIN_SEGMENTS, dtype=np.bool_)


def averaged_over_dropouts(
    twist: FloatArray, seen: FloatArray, blind: BoolArray, sigma: FloatArray
) -> DropoutVelocities:
    """Recorded velocities (T-1, 6) of noise `sigma` (6,), those of `blind` intervals averaged over neighbors.

    The number of neighbors minimizes, for each component and length of a dropout, the noise of the average plus its
    bias. The bias is the difference of the mean over a stretch from that over stretch and neighbors in the odometry
    `seen` (T-1, 6, NaN where unknown). The intervals of a dropout share their error, which is divided among them.
    """
    result, deviation = twist.copy(), np.tile(sigma, (len(twist), 1))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], blind, [False]]).astype(np.int8)))
    taken = np.zeros(len(twist), dtype=np.bool_)
    margins: dict[int, tuple[IntArray, FloatArray]] = {}
    for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        length = end - start
        if length > LONGEST:
            continue
        if length not in margins:
            margins[length] = _best_margins(seen, length, sigma)
        margin, error = margins[length]
        for axis in np.flatnonzero(margin).tolist():
            around = slice(max(0, start - margin[axis]), end + margin[axis])
            result[start:end, axis] = twist[around, axis].mean()
            deviation[start:end, axis] = error[axis]
            taken[start:end] = True
    return DropoutVelocities(result, deviation, np.flatnonzero(taken))


def _best_margins(seen: FloatArray, length: int, sigma: FloatArray) -> tuple[IntArray, FloatArray]:
    """For each component how many neighbors to either side (6,), and the deviation (6,) of each interval then."""
    variance = np.full((MAX_MARGIN + 1, len(sigma)), np.inf)
    variance[0] = sigma**2
    for margin in range(1, MAX_MARGIN + 1):
        size = length + 2 * margin
        if len(seen) < size:
            break
        stretches = sliding_window_view(seen, size, axis=0)
        stretches = stretches[np.isfinite(stretches).all(axis=(1, 2))]
        if len(stretches) < MIN_SAMPLES:
            break
        off = stretches[:, :, margin : margin + length].mean(axis=2) - stretches.mean(axis=2)
        variance[margin] = length * (sigma**2 / size + np.mean(off**2, axis=0))
    best = np.argmin(variance, axis=0)
    return best, np.sqrt(variance[best, np.arange(len(sigma))])
