"""The one place where our conventions meet GTSAM's: keys, poses and the order of tangent vectors."""

from typing import Any

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray

ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2])
"""takes [v, w] (ours) to [w, v] (GTSAM's), and back"""


def pose_key(frame: int) -> int:
    """GTSAM's key of the pose of a frame."""
    return int(gtsam.symbol("x", frame))


def landmark_key(landmark: int) -> int:
    """GTSAM's key of a landmark, by its index in the sequence."""
    return int(gtsam.symbol("l", landmark))


def described_key(key: int) -> tuple[str, int]:
    """('pose' or 'landmark', index) of a key."""
    symbol = gtsam.Symbol(key)
    return {"x": "pose", "l": "landmark"}[chr(symbol.chr())], int(symbol.index())


def reordered(covariance: Any) -> FloatArray:
    """A covariance or information matrix (..., 6, 6) from [v, w] to [w, v], or back."""
    matrix = np.asarray(covariance, dtype=np.float64)
    return matrix[..., ROTATION_FIRST[:, None], ROTATION_FIRST[None, :]]
