"""Prior of the inverse depths of landmarks that one camera sees for the first time, from the scene as it is known."""

import numpy as np

from fgbaseline.data.problem import InverseDepthPrior, Problem
from fgbaseline.geometry import FloatArray, se3

from .landmark_representation import homogeneous
from .state import JointState

KNOWN = 0.3
"""relative sigma below which a landmark's inverse depth is known"""
MIN_KNOWN = 5
"""known landmarks that make a scene"""


def inverse_depth_prior(problem: Problem, state: JointState, cam_T_imu: FloatArray) -> InverseDepthPrior | None:
    """Prior at the median inverse depth of the known landmarks in front of the camera, or else that of the problem.

    Its sigma is its mean. An error of the mean is common to all landmarks, so that a narrow prior of many landmarks
    would determine the scale.
    """
    inverse, sigma = state.xi[:, 2], np.sqrt(np.diagonal(state.P)[state.n_body + 2 :: 3])
    known = sigma < KNOWN * inverse
    points = homogeneous(state.charts[known], state.xi[known]) @ (cam_T_imu @ se3.affine_inverse(state.pose)).T
    points = points[points[:, 2] > 0.0]
    if len(points) < MIN_KNOWN:
        return problem.inverse_depth_prior
    median = float(np.median(points[:, 3] / points[:, 2]))
    return InverseDepthPrior(median, median)
