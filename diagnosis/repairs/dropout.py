"""Over an interval that the cameras do not see, the velocities of its neighbours tell more than its own noisy sample.

The velocity of a body changes little within a few intervals; where its measurement has more noise than that, an average
over the neighbours is nearer to the truth. Where the cameras see the motion this is not needed, and would make the
errors of neighbouring increments depend on each other; where they are blind for an interval or two, everything that
follows hangs on that one sample.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fgbaseline.data.observations import BoolArray, IntArray, Observations
from fgbaseline.geometry import FloatArray

from ..odometry.stereo_odometry import MIN_LINKS

MAX_MARGIN = 8
"""intervals to each side"""
MIN_SAMPLES = 20
"""stretches of seen motion from which to tell how much a velocity changes"""
LONGEST = 10
"""intervals: a longer blind stretch is left to its own samples, whose noise averages by itself"""


@dataclass(frozen=True, eq=False, slots=True)
class DropoutVelocities:
    """Velocities of all intervals, and what is known of them."""

    twist: FloatArray
    """(T-1, 6) m/s and rad/s"""
    deviation: FloatArray
    """(T-1, 6) of independent errors of the intervals"""
    blind: IntArray
    """the intervals that take their velocity from their neighbours"""


def dropout_intervals(observations: Observations, n_frames: int) -> BoolArray:
    """(T-1,) those whose two frames have too few landmarks in common to tell the motion between them."""
    order = observations.by_track()
    frame, landmark = observations.frame[order], observations.landmark[order]
    linked = (landmark[:-1] == landmark[1:]) & (frame[:-1] + 1 == frame[1:])
    count = np.bincount(frame[:-1][linked], minlength=n_frames - 1)
    return np.asarray(count < MIN_LINKS, dtype=np.bool_)


def averaged_over_dropouts(
    twist: FloatArray, seen: FloatArray, blind: BoolArray, sigma: FloatArray
) -> DropoutVelocities:
    """Recorded velocities (T-1, 6) of noise `sigma` (6,), those of `blind` intervals averaged over their neighbours.

    How many neighbours is decided for each component and length of a blind stretch: the noise of the average against
    how far the mean over a stretch is from that over stretch and neighbours, in what the cameras have `seen` (T-1, 6,
    NaN where nothing). The intervals of a stretch share their error, which is spread over them.
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
    """For each component how many neighbours to either side (6,), and the deviation (6,) of each interval then."""
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
