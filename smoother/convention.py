"""The one place where the order of tangent vectors is turned from ours into GTSAM's."""

from typing import Any

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray

ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2])
"""takes [v, w] (ours) to [w, v] (GTSAM's), and back"""


def pose_covariances(problem: Problem, covariance: Any, first: int = 0) -> FloatArray:
    """Covariances (n, 6, 6) of the poses of the frames from `first` on, from GTSAM's order to ours.

    That of a first pose that the problem holds is zero, and not what stands for zero in the graph.
    """
    matrix = reordered(covariance)
    if first == 0 and not problem.initial_covariance.any():
        matrix[:1] = 0.0
    return matrix


def reordered(covariance: Any) -> FloatArray:
    """A covariance or information matrix (..., 6, 6) from [v, w] to [w, v], or back."""
    matrix = np.asarray(covariance, dtype=np.float64)
    return matrix[..., ROTATION_FIRST[:, None], ROTATION_FIRST[None, :]]
