"""From GTSAM's values to arrays."""

from collections.abc import Callable, Iterable

import gtsam
import numpy as np

from fgbaseline.data.observations import IntArray, Observations
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3

from .keys import pose_key


def poses_of(values: gtsam.Values, n_frames: int) -> FloatArray:
    """(n_frames, 4, 4) world_T_imu of the frames from 0 on."""
    return np.array([values.atPose3(pose_key(k)).matrix() for k in range(n_frames)]).reshape(-1, 4, 4)


def points_of(values: gtsam.Values, landmarks: Iterable[int], key: Callable[[int], int]) -> FloatArray:
    """(m, 3) positions of landmarks, by their indices in the sequence, which `key` turns into GTSAM's."""
    return np.array([values.atPoint3(key(j)) for j in landmarks]).reshape(-1, 3)


def depths(
    problem: Problem, observations: Observations, world_T_imu: FloatArray, landmarks: IntArray, position: FloatArray
) -> FloatArray:
    """(n,) m: how far in front of the left camera each observation's landmark is.

    `landmarks` (m,) are increasing indices with positions (m, 3); every observation must be of one of them.
    """
    cam_T_world = se3.inverse(world_T_imu @ problem.sequence.imu_T_cam)[observations.frame]
    points = position[np.searchsorted(landmarks, observations.landmark)]
    return se3.transform(cam_T_world, points)[:, 2]
