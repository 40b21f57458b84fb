"""Which landmarks enter the joint filter's state where there are more than it has places for.

The cost of a frame grows with the third power of the landmarks in the state, its memory with the second, so there is an
end to them. A filter does not know how long a landmark will be seen. What it knows is where each one is in the image
and how near: sights spread over the image tell turning from moving sideways, and of those in one place the nearest
tells most of the motion. So places go round the image, cell by cell, the largest disparity of each cell first
(Geiger, Ziegler and Stiller 2011 bucket the features of their odometry in this way).
"""

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray

CELL = 64.0
"""px, edge of the square cells of the image"""


def select_features(candidates: FloatArray, inside: FloatArray, places: int) -> BoolArray:
    """(n,) which of n landmarks enter, `places` at most, by the rows uL, uR, v (n, 3) at which the frame sees them.

    `inside` (m, 3) are the rows of those that the frame sees and the state has already: their cells have had a turn.
    """
    n = len(candidates)
    selected: BoolArray = np.ones(n, dtype=np.bool_)
    if n <= max(places, 0):
        return selected
    cell = _cells(np.concatenate([candidates, inside]))
    nearness = candidates[:, 0] - candidates[:, 1]
    order = np.lexsort((-nearness, cell[:n]))
    number = np.bincount(cell[:n])
    turn = np.empty(n, dtype=np.int64)
    turn[order] = np.arange(n) - np.repeat(np.cumsum(number) - number, number)
    turn += np.bincount(cell[n:], minlength=cell.max() + 1)[cell[:n]]
    selected[np.lexsort((-nearness, turn))[max(places, 0) :]] = False
    return selected


def _cells(rows: FloatArray) -> IntArray:
    """(n,) a number for the cell of the left image in which each of the rows (n, 3) lies, counted from 0."""
    corner = np.floor(rows[:, [0, 2]] / CELL)
    return np.unique(corner, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)
