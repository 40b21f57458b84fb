"""Sentences on the tracks of a recording: their number and length, and cells of the image with few observations."""

import numpy as np

from fgbaseline.compare.residuals.residual_classes import REGION_COLUMNS, REGION_ROWS
from fgbaseline.data import Sequence
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray

from ..formatting import limit_per_cent, listed, number

SPARSE = 0.25
"""part of an even share of the observations, below which a cell of the 3 x 3 grid is sparse"""


def track_sentences(sequence: Sequence, size: tuple[float, float]) -> list[str]:
    """Number and length of the tracks, observations a frame, and sparse cells of a left image of `size`, px."""
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
        f"{number(float(per_frame.mean()))} recorded observations a frame on average, fewest in frame {fewest} "
        f"({int(per_frame[fewest])}).",
        _sparse(o.pixel[:, :2], size, "image" if sequence.monocular else "left image"),
    ]


def _sparse(pixel: FloatArray, size: tuple[float, float], image: str) -> str:
    """Sentence on the cells of the `image`, by its name, with few points (n, 2)."""
    ends = np.array(size)
    cell = np.clip((3.0 * pixel / ends).astype(np.int64), 0, 2)
    share = np.bincount(3 * cell[:, 1] + cell[:, 0], minlength=9) / len(pixel)
    places = [f"{REGION_ROWS[k // 3]} {REGION_COLUMNS[k % 3]}" for k in np.flatnonzero(share < SPARSE / 9.0)]
    few = f"below {limit_per_cent(SPARSE)} of an even share"
    return f"Sparse cells of the 3 x 3 grid of the {image} ({few}): {listed(places) or 'none'}."
