"""From GTSAM's values to arrays."""

from collections.abc import Iterable, Mapping

import gtsam
import numpy as np

from fgbaseline.data.estimate import Landmarks
from fgbaseline.geometry import FloatArray, so3

from .keys import pose_key


def poses_of(values: gtsam.Values, frames: Iterable[int]) -> FloatArray:
    """(n, 4, 4) world_T_imu of the frames, their rotations exact: GTSAM's lose that by rounding in long descents."""
    poses = np.array([values.atPose3(pose_key(k)).matrix() for k in frames]).reshape(-1, 4, 4)
    poses[:, :3, :3] = so3.rotation_from_quaternion(so3.quaternion_xyzw(poses[:, :3, :3]))
    return poses


def landmarks_of(
    values: gtsam.Values, keys: Mapping[int, int], covariance: Mapping[int, FloatArray] | None = None
) -> Landmarks:
    """The landmarks (index in the sequence -> key), with their covariances where there are any by key."""
    index = sorted(keys)
    position = np.array([values.atPoint3(keys[j]) for j in index]).reshape(-1, 3)
    shape = None if covariance is None else np.array([covariance[keys[j]] for j in index]).reshape(-1, 3, 3)
    return Landmarks(np.array(index, dtype=np.int64), position, shape)
