"""The edge to GTSAM: the order of tangent vectors, and the world in which an incremental solver works."""

from dataclasses import replace
from typing import Any

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3

ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2])
"""takes [v, w] (ours) to [w, v] (GTSAM's), and back"""


def from_first_pose(problem: Problem) -> Problem:
    """The problem in the world of its first pose, whose answer `Estimate.moved` by that pose is that of the problem.

    GTSAM relinearizes a landmark by each coordinate of its step in the world: what an incremental solver does would
    depend on how the world is turned.
    """
    world_T_first, prior = problem.initial_pose, problem.landmark_prior
    if np.array_equal(world_T_first, np.eye(4)):
        return problem
    if prior is not None:
        first_T_world = se3.inverse(world_T_first)
        R = first_T_world[:3, :3]
        prior = replace(prior, mean=se3.transform(first_T_world, prior.mean), covariance=R @ prior.covariance @ R.T)
    return replace(problem, initial_pose=np.eye(4), landmark_prior=prior)


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
