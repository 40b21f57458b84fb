"""How far back the tracks reach that are alive."""

import numpy as np

from fgbaseline.data.observations import Observations

UNSEEN_FRAMES = 2
"""for which a track without an observation may still go on: the mask interrupts tracks for that long"""


def earliest_tracked(o: Observations, k: int) -> int:
    """The first frame of all tracks that the frames up to k have seen, the last time at k - UNSEEN_FRAMES or later.

    The frame after k, where there is none.
    """
    recent, now = np.searchsorted(o.frame, [k - UNSEEN_FRAMES, k + 1])
    alive = np.isin(o.landmark[:now], o.landmark[recent:now])
    return int(o.frame[:now][alive].min(initial=k + 1))
