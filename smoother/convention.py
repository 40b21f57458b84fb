"""The one place where the order of tangent vectors is turned from ours into GTSAM's."""

from typing import Any

import numpy as np

from fgbaseline.geometry import FloatArray

ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2])
"""takes [v, w] (ours) to [w, v] (GTSAM's), and back"""


def reordered(covariance: Any) -> FloatArray:
    """A covariance or information matrix (..., 6, 6) from [v, w] to [w, v], or back."""
    matrix = np.asarray(covariance, dtype=np.float64)
    return matrix[..., ROTATION_FIRST[:, None], ROTATION_FIRST[None, :]]
