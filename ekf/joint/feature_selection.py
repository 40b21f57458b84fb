"""Feature selection for a full joint state: bucketing over the image, largest disparity of each cell first.

The cost of a frame grows with the cube of the number of landmarks in the state, its memory with the square. Features
spread over the image separate rotation from sideways translation, and the nearest of a cell constrain translation
best. Places are therefore assigned cell by cell in turns (Geiger, Ziegler and Stiller, 2011).
"""

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement_model import STEREO_ROWS

CELL = 64.0
"""Edge of the square image cells, px."""


def select_features(candidates: FloatArray, inside: FloatArray, places: int) -> BoolArray:
    """Mask (n,) of at most `places` selected landmarks, from their measured rows uL, uR, v (n, 3), or uL, v (n, 2), px.

    `inside` (m, r) holds the rows of observed landmarks already in the state: each counts as a turn of its cell.
    """
    n = len(candidates)
    selected: BoolArray = np.ones(n, dtype=np.bool_)
    if n <= max(places, 0):
        return selected
    cell = _cells(np.concatenate([candidates, inside]))
    nearness = candidates[:, 0] - candidates[:, 1] if candidates.shape[1] == len(STEREO_ROWS) else np.zeros(n)
    order = np.lexsort((-nearness, cell[:n]))
    number = np.bincount(cell[:n])
    turn = np.empty(n, dtype=np.int64)
    turn[order] = np.arange(n) - np.repeat(np.cumsum(number) - number, number)
    turn += np.bincount(cell[n:], minlength=cell.max() + 1)[cell[:n]]
    selected[np.lexsort((-nearness, turn))[max(places, 0) :]] = False
    return selected


def _cells(rows: FloatArray) -> IntArray:
    """Index (n,) of the left-image cell of each of the rows (n, r), counted from 0."""
    corner = np.floor(rows[:, [0, -1]] / CELL)
    return np.unique(corner, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)
