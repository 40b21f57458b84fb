"""A standing start, decided with the cameras: vibration moves the inertial samples of a vehicle that stands.

While it stands, the tracks of frame 0 stay in sight, so that keyframes far apart share them.
"""

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.sequence import Sequence

STILL = 2.0
"""px, median shift of the tracks of frame 0 up to which the camera stands"""
MIN_TRACKS = 8
SHORTEST = 0.5
"""s, shortest standing start that is used"""
LONGEST = 3.0
"""s, longest part of a standing start that is used"""
KEYFRAMES = 20


def standing_frames(sequence: Sequence, longest: float = LONGEST) -> IntArray:
    """Frames (k,) from 0 on in which the camera stands still, at most `longest` s; frame 0 alone if it moves.

    Frames whose tracks are too few are bridged.
    """
    o = sequence.observations
    starts = o.frame_starts(sequence.n_frames)
    first = slice(int(starts[0]), int(starts[1]))
    last = int(np.searchsorted(sequence.t, sequence.t[0] + longest, side="right"))
    frames = [0]
    for k in range(1, last):
        at = slice(int(starts[k]), int(starts[k + 1]))
        _, before, after = np.intersect1d(o.landmark[first], o.landmark[at], return_indices=True)
        if len(before) < MIN_TRACKS:
            continue
        shift = np.linalg.norm(o.pixel[at][after, :2] - o.pixel[first][before, :2], axis=1)
        if float(np.median(shift)) > STILL:
            break
        frames.append(k)
    return np.array(frames, dtype=np.int64)


def stands(sequence: Sequence, frames: IntArray) -> bool:
    """Whether standing `frames` last long enough for a standing start."""
    return bool(len(frames) >= 3 and sequence.t[frames[-1]] - sequence.t[0] >= SHORTEST)


def keyframes_of(frames: IntArray) -> IntArray:
    """Keyframes (n,): at most `KEYFRAMES` of the frames, evenly spaced."""
    chosen = np.unique(np.linspace(0, len(frames) - 1, min(KEYFRAMES, len(frames))).round().astype(np.int64))
    return np.asarray(frames[chosen], dtype=np.int64)
