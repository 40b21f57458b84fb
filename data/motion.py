"""From recorded velocities to motion increments and the dead-reckoned path."""

from enum import Enum

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from .sequence import Sequence


class Shift(float, Enum):
    """Usual answers to which interval a velocity sample belongs to, as a shift in intervals."""

    AFTER = 0.0
    """u_k moves frame k to k+1 (the report's reading)"""
    MIDDLE = -0.5
    """u_k is the velocity at the instant of frame k: the mean of u_k and u_(k+1) moves k to k+1"""
    BEFORE = -1.0
    """u_(k+1) moves k to k+1"""

    def __format__(self, form: str) -> str:
        """As any number: an Enum would write its name into sentences and files."""
        return format(float(self), form)


def zero_order_hold(sequence: Sequence, shift: float = Shift.AFTER) -> FloatArray:
    """(T-1, 6) recorded velocity [v, w] of each interval, each sample held for one interval.

    Sample k is held from `shift` intervals after its stamp on; between the whole ones, two neighbours share an interval
    in proportion. The first and the last sample hold on beyond the ends.
    """
    u = np.concatenate([sequence.linear_velocity, sequence.angular_velocity], axis=1)
    last = len(u) - 1
    whole, part = divmod(-float(shift), 1.0)
    first = np.clip(np.arange(last) + int(whole), 0, last)
    return (1.0 - part) * u[first] + part * u[np.minimum(first + 1, last)]


def increments(sequence: Sequence, shift: float = Shift.AFTER) -> FloatArray:
    """(T-1, 6) twists [v, w] times dt (m, rad), each the motion from one frame to the next (tau u of equation 9)."""
    return zero_order_hold(sequence, shift) * sequence.dt[:, None]


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
