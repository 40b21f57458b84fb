"""How far back the frames still to come reach."""

import numpy as np

from fgbaseline.data.observations import IntArray, Observations


def earliest_needed(o: Observations, n_frames: int) -> IntArray:
    """(T,) for each frame the earliest of those up to it that saw a landmark which a later one sees again.

    The frame after it, where there is none: from then on nothing hangs on it but the motion.
    """
    n = int(o.landmark.max(initial=-1)) + 1
    first, last = np.full(n, n_frames), np.zeros(n, dtype=np.int64)
    np.minimum.at(first, o.landmark, o.frame)
    np.maximum.at(last, o.landmark, o.frame)
    again = last > first
    reached = np.arange(1, n_frames + 1)
    np.minimum.at(reached, last[again] - 1, first[again])
    needed: IntArray = np.minimum.accumulate(reached[::-1])[::-1]
    return needed
