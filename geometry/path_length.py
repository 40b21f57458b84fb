"""Length of the path through positions, some of which may be missing."""

import numpy as np

from .so3 import FloatArray


def distance_traveled(positions: FloatArray) -> FloatArray:
    """Length (T,) of the path so far through positions (T, 3), m; missing ones (NaN) are bridged by a straight line.

    The length of the bridge counts from the next known position on.
    """
    known = np.isfinite(positions).all(axis=1)
    steps = np.linalg.norm(np.diff(positions[known], axis=0), axis=1)
    lengths = np.concatenate([[0.0, 0.0], np.cumsum(steps)])
    return np.asarray(lengths[np.cumsum(known)], dtype=np.float64)


def path_length(positions: FloatArray) -> float:
    """Length of the whole path through positions (T, 3), m, as of `distance_traveled`; 0 without a known position."""
    return float(distance_traveled(positions)[-1]) if len(positions) else 0.0
