"""Conversions to and from GTSAM: tangent order, covariances, values, and the frame of an incremental solver."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import gtsam
import numpy as np

from fgbaseline.data.estimators.estimate import Landmarks
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3, so3, strapdown

from .keys import landmark_key, pose_key

ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2])
"""Index that takes [v, w] (ours) to [w, v] (GTSAM), and back."""
STATE_ORDER = np.r_[ROTATION_FIRST, 6:9, 12:15, 9:12]
"""Index that takes our error state, and noise, to GTSAM's, which has the accelerometer's bias first, and back."""


def in_solver_frame(problem: Problem) -> tuple[Problem, FloatArray]:
    """The problem in the frame of its first pose, and that pose (4, 4); `Estimate.transformed` by it undoes the change.

    GTSAM relinearizes a landmark by each coordinate of its step in the world: what an incremental solver does would
    depend on how the world is turned. With raw inertial data z stays up, and the frame is that of the first pose but
    for the smallest rotation that takes the pose's up to z.
    """
    first = np.eye(4)
    if problem.imu is not None:
        first[:3, :3] = so3.rotation_to_z(problem.initial_pose[2, :3])
    world_T_solver = problem.initial_pose @ se3.inverse(first)
    prior, start = problem.landmark_prior, problem.start
    if np.array_equal(world_T_solver, np.eye(4)):
        return problem, world_T_solver
    solver_T_world = se3.inverse(world_T_solver)
    R = solver_T_world[:3, :3]
    if prior is not None:
        prior = replace(prior, mean=se3.transform(solver_T_world, prior.mean), covariance=R @ prior.covariance @ R.T)
    if start is not None:
        covariance = strapdown.rotated_velocity(start.covariance, R, R)
        start = replace(start, velocity=R @ start.velocity, covariance=covariance)
    return replace(problem, initial_pose=first, landmark_prior=prior, start=start), world_T_solver


def state_covariances(problem: Problem, covariance: Any, first: int = 0) -> FloatArray:
    """Covariances (n, 6, 6) of the poses of the frames from `first` on, or (n, 15, 15) of their states, from GTSAM's
    order to ours.

    They are zero in the fixed directions of the first pose, where the graph has small sigmas in place of zero.
    """
    matrix = reorder_tangent(covariance)
    if problem.start is not None:
        matrix = 0.5 * (matrix + np.swapaxes(matrix, -1, -2))
    if first == 0 and problem.start is not None:
        directions, free = problem.start.free_directions[:6], np.eye(len(STATE_ORDER))
        free[:6, :6] = directions @ directions.T
        matrix[:1] = free @ matrix[:1] @ free
    elif first == 0 and not problem.initial_covariance.any():
        matrix[:1] = 0.0
    return matrix


def reorder_tangent(covariance: Any) -> FloatArray:
    """A covariance or information matrix, (..., 6, 6) of a pose or (..., 15, 15) of a state, to GTSAM's order, or
    back."""
    matrix = np.asarray(covariance, dtype=np.float64)
    order = ROTATION_FIRST if matrix.shape[-1] == len(ROTATION_FIRST) else STATE_ORDER
    return matrix[..., order[:, None], order[None, :]]


def bias_to_gtsam(bias: FloatArray) -> gtsam.imuBias.ConstantBias:
    """GTSAM's bias of biases (6,), gyroscope first."""
    return gtsam.imuBias.ConstantBias(bias[3:], bias[:3])


def bias_from_gtsam(bias: gtsam.imuBias.ConstantBias) -> FloatArray:
    """Biases (6,), gyroscope first."""
    return np.concatenate([bias.gyroscope(), bias.accelerometer()])


def poses_from_values(values: gtsam.Values, frames: Iterable[int]) -> FloatArray:
    """Poses world_T_imu (n, 4, 4) of the frames, renormalized: rounding accumulates over many steps of GTSAM."""
    return rigid_poses(np.array([values.atPose3(pose_key(k)).matrix() for k in frames]).reshape(-1, 4, 4))


def rigid_poses(poses: FloatArray) -> FloatArray:
    """Normalize the rotations of poses (n, 4, 4) in place."""
    poses[:, :3, :3] = so3.rotation_from_quaternion(so3.quaternion_xyzw(poses[:, :3, :3]))
    return poses


def landmarks_from_values(
    values: gtsam.Values, keys: Mapping[int, int], covariance: Mapping[int, FloatArray] | None = None
) -> Landmarks:
    """Landmarks of `keys` (landmark -> key), with covariances by key if given."""
    index = sorted(keys)
    position = np.array([values.atPoint3(keys[j]) for j in index]).reshape(-1, 3)
    shape = None if covariance is None else np.array([covariance[keys[j]] for j in index]).reshape(-1, 3, 3)
    return Landmarks(np.array(index, dtype=np.int64), position, shape)


def values_from_state(world_T_imu: FloatArray, landmarks: Landmarks) -> gtsam.Values:
    """GTSAM values of poses (T, 4, 4) and landmarks."""
    values = gtsam.Values()
    for k, pose in enumerate(world_T_imu):
        values.insert(pose_key(k), gtsam.Pose3(pose))
    for j, position in zip(landmarks.index.tolist(), landmarks.position, strict=True):
        values.insert(landmark_key(j), position)
    return values
