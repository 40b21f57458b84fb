"""Sentences on the tracks of a recording: how many, how long, and where the image is empty."""

import numpy as np

from fgbaseline.data import Sequence
from fgbaseline.data.plural import plural
from fgbaseline.geometry import FloatArray

from ..formatting import listed, number, per_cent

ROWS, COLUMNS = ("top", "middle", "bottom"), ("left", "center", "right")
EMPTY = 0.25
"""of an even share of the observations, below which a ninth of the image counts as empty"""


def track_sentences(sequence: Sequence, size: tuple[float, float]) -> list[str]:
    """Number and length of the tracks, observations a frame, and the empty ninths of a left image of `size`, px."""
    o, T = sequence.observations, sequence.n_frames
    if len(o) == 0:
        return []
    length = o.counts(sequence.n_landmarks)
    length = length[length > 0]
    per_frame = np.bincount(o.frame, minlength=T)
    fewest = int(np.argmin(per_frame))
    return [
        f"{plural(len(length), 'track')} of {number(float(length.mean()))} frames on average (median "
        f"{int(np.median(length))}, longest {int(length.max())}).",
        f"{number(float(per_frame.mean()))} observations a frame on average, fewest in frame {fewest} "
        f"({int(per_frame[fewest])}).",
        _empty(o.pixel[:, :2], size),
    ]


def _empty(pixel: FloatArray, size: tuple[float, float]) -> str:
    """Sentence on the ninths of the image with few points (n, 2)."""
    ends = np.array(size)
    cell = np.clip((3.0 * pixel / ends).astype(np.int64), 0, 2)
    share = np.bincount(3 * cell[:, 1] + cell[:, 0], minlength=9) / len(pixel)
    places = [f"{ROWS[k // 3]} {COLUMNS[k % 3]}" for k in np.flatnonzero(share < EMPTY / 9.0)]
    if not places:
        return "No ninth of the left image is empty."
    few = f"less than {per_cent(EMPTY)} of an even share of the observations"
    return f"Empty ninths of the left image ({few}): {listed(places)}."
