"""From recorded velocities to motion increments and the dead-reckoned path."""

from enum import StrEnum

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from .sequence import Sequence


class Interval(StrEnum):
    """Which samples move frame k to frame k+1."""

    AFTER = "after"
    """u_k: a sample belongs to the interval after it (the report's reading)"""
    MEAN = "mean"
    """(u_k + u_(k+1)) / 2"""
    BEFORE = "before"
    """u_(k+1): a sample belongs to the interval before it"""


def increments(sequence: Sequence, interval: Interval = Interval.AFTER) -> FloatArray:
    """(T-1, 6) twists [v, w] times dt (m, rad), each the motion from one frame to the next (tau u of equation 9)."""
    u = np.concatenate([sequence.linear_velocity, sequence.angular_velocity], axis=1)
    match interval:
        case Interval.AFTER:
            sample = u[:-1]
        case Interval.BEFORE:
            sample = u[1:]
        case Interval.MEAN:
            sample = 0.5 * (u[:-1] + u[1:])
    return sample * sequence.dt[:, None]


def dead_reckoned_path(increment: FloatArray, initial_pose: FloatArray | None = None) -> FloatArray:
    """(T, 4, 4) world_T_imu along increments (T-1, 6): the mean of equation 9."""
    return se3.compose(se3.exp(increment), initial_pose)


def back_project(sequence: Sequence, world_T_imu: FloatArray, chosen: np.ndarray | slice = slice(None)) -> FloatArray:
    """(n, 3) world points, m, of the chosen observations, each from its own disparity and frame (equation 10).

    Not finite where the disparity is exactly zero.
    """
    o = sequence.observations
    world_T_cam = world_T_imu @ sequence.imu_T_cam
    return se3.transform(world_T_cam[o.frame[chosen]], sequence.camera.triangulate(o.pixel[chosen]))
