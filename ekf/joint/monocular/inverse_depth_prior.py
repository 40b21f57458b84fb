"""Prior of the inverse depths of landmarks that one camera sees for the first time.

Depths of a scene resemble each other: ln(rho) = c + e, with rho the inverse depth in the camera, c common to the scene
and e of each landmark. c is the mean over the known landmarks of the state, and has their errors. So a landmark begins
as far away as its scene *in the state's own scale*: a constant in place of c would be information about the scale, the
more the more landmarks begin. In the same way rho is that of the camera as it is, which the error of the pose moves.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem import InverseDepthPrior
from fgbaseline.geometry import FloatArray, se3

from ...motion_model import POSE
from ..landmark_representation import homogeneous
from ..state import JointState

KNOWN = 0.3
"""relative sigma below which a landmark's inverse depth is known"""
MIN_KNOWN = 5
"""number of known landmarks from which on the depth of the scene is estimated"""
UNKNOWN_SCALE = 1.0
"""sigma of c where no landmark is known"""


class SceneDepth(NamedTuple):
    """Inverse depth of a scene, of which the state knows some landmarks."""

    mean: float
    """exp(c), the inverse depth of the scene, 1/m"""
    spread: float
    """sigma of e"""
    covariance: FloatArray
    """(size,) covariance of the error of c with that of the state"""
    variance: float
    """variance of c"""


def scene_depth(prior: InverseDepthPrior, state: JointState, cam_T_imu: FloatArray) -> SceneDepth:
    """Inverse depth of the known landmarks in front of the camera; without enough of them that of the problem."""
    spread = prior.sigma / prior.mean
    known = _known(state)
    rho, H_pose, H_xi = inverse_depths(state.pose, cam_T_imu, state.charts[known], state.xi[known])
    front = rho > 0.0
    known, rho, H_pose, H_xi = known[front], rho[front], H_pose[front], H_xi[front]
    n = len(known)
    if n < MIN_KNOWN:
        return SceneDepth(prior.mean, spread, np.zeros(state.size), UNKNOWN_SCALE**2)
    slope = np.zeros(state.size)
    slope[:POSE] = (1.0 / (n * rho)) @ H_pose
    slope[state.n_body :].reshape(-1, 3)[known] = H_xi / (n * rho[:, None])
    covariance = state.P @ slope
    mean = float(np.exp(np.mean(np.log(rho))))
    return SceneDepth(mean, spread, covariance, float(slope @ covariance))


def common_change(before: FloatArray, state: JointState) -> float:
    """Factor by which an update has changed the known inverse depths together.

    `before` (count,), 1/m, are the inverse depths in all slots before it. Known landmarks count by the square of their
    relative accuracy; 1 where they are few.
    """
    known = _known(state)
    known = known[before[known] > 0.0]
    if len(known) < MIN_KNOWN:
        return 1.0
    rho = state.xi[known, 2]
    weight = rho**2 / np.diagonal(state.P)[state.n_body + 3 * known + 2]
    return float(np.exp(weight @ np.log(rho / before[known]) / weight.sum()))


def _known(state: JointState) -> IntArray:
    """Slots (n,) of the landmarks whose inverse depth is known."""
    sigma = np.sqrt(np.diagonal(state.P)[state.n_body + 2 :: 3])
    return np.flatnonzero((sigma < KNOWN * state.xi[:, 2]) & (state.feature < state.n_features))


def inverse_depths(
    pose: FloatArray, cam_T_imu: FloatArray, charts: FloatArray, xi: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Inverse depths (n,), 1/m, of landmarks xi (n, 3) in charts (n, 4, 4), with Jacobians (n, 6) and (n, 3).

    These are w.r.t. the right perturbation of the pose (4, 4) and w.r.t. xi.
    """
    imu_T_world = se3.affine_inverse(pose)
    in_imu = homogeneous(charts, xi) @ imu_T_world.T
    camera = in_imu @ cam_T_imu.T
    z, w = camera[:, 2], camera[:, 3]
    by_pose = -np.einsum("a,iab,nb->ni", cam_T_imu[2], se3.hat(np.eye(POSE)), in_imu)  # of z
    by_xi = (cam_T_imu @ imu_T_world)[2:] @ charts[:, :, :3]  # (n, 2, 3) of z and w
    slope = -w / z**2
    return w / z, slope[:, None] * by_pose, by_xi[:, 1] / z[:, None] + slope[:, None] * by_xi[:, 0]
