"""Conversions to and from GTSAM: tangent order, covariances, values, and the frame of an incremental solver."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import gtsam
import numpy as np

from fgbaseline.data.estimate import Landmarks
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3, so3

from .keys import landmark_key, pose_key

ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2])
"""Index that takes [v, w] (ours) to [w, v] (GTSAM), and back."""


def in_first_pose_frame(problem: Problem) -> Problem:
    """Express the problem in the frame of its first pose; `Estimate.transformed` by that pose reverts it.

    GTSAM tests relinearization per world coordinate, so that an incremental solution would depend on the orientation of
    the world.
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
    """Covariances (n, 6, 6) of the poses from frame `first` on, in the order [v, w].

    A fixed first pose has covariance zero, not the small one of its prior in the graph.
    """
    matrix = reorder_tangent(covariance)
    if first == 0 and not problem.initial_covariance.any():
        matrix[:1] = 0.0
    return matrix


def reorder_tangent(covariance: Any) -> FloatArray:
    """Covariance or information matrix (..., 6, 6) reordered from [v, w] to [w, v], or back."""
    matrix = np.asarray(covariance, dtype=np.float64)
    return matrix[..., ROTATION_FIRST[:, None], ROTATION_FIRST[None, :]]


def poses_from_values(values: gtsam.Values, frames: Iterable[int]) -> FloatArray:
    """Poses world_T_imu (n, 4, 4) of the frames, renormalized because GTSAM's rotations drift by rounding."""
    poses = np.array([values.atPose3(pose_key(k)).matrix() for k in frames]).reshape(-1, 4, 4)
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
