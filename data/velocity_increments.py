"""Motion increments and dead-reckoned path from recorded velocities."""

from enum import Enum

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from .sequence import Sequence


class Shift(float, Enum):
    """Interval over which velocity sample u_k of frame k holds, as a shift in intervals; the usual cases."""

    AFTER = 0.0
    """after frame k: u_k moves frame k to k+1 (source paper)"""
    MIDDLE = -0.5
    """around frame k, at whose instant it is measured: the mean of u_k and u_(k+1) moves k to k+1"""
    BEFORE = -1.0
    """before frame k: u_(k+1) moves k to k+1"""

    def __format__(self, form: str) -> str:
        """Number as text: an Enum would print its name."""
        return format(float(self), form)


def zero_order_hold(sequence: Sequence, shift: float = Shift.AFTER) -> FloatArray:
    """Velocity [v, w] (T-1, 6) of each interval by zero-order hold of the recorded samples.

    Sample k is held for one interval, from `shift` intervals after its stamp. A fractional shift weights two
    neighbors in proportion. The first and last samples extend beyond the ends.
    """
    return held_samples(np.concatenate([sequence.linear_velocity, sequence.angular_velocity], axis=1), shift)


def held_samples(u: FloatArray, shift: float) -> FloatArray:
    """Samples (T, c) by zero-order hold over each of the intervals (T-1, c), as `zero_order_hold`."""
    last = len(u) - 1
    whole, part = divmod(-float(shift), 1.0)
    first = np.clip(np.arange(last) + int(whole), 0, last)
    return (1.0 - part) * u[first] + part * u[np.minimum(first + 1, last)]


def increments(sequence: Sequence, shift: float = Shift.AFTER) -> FloatArray:
    """Increments [v, w] dt (T-1, 6), m and rad, from each frame to the next (tau u of equation 9)."""
    return zero_order_hold(sequence, shift) * sequence.dt[:, None]


def dead_reckoned_path(increment: FloatArray, initial_pose: FloatArray | None = None) -> FloatArray:
    """Dead-reckoned poses world_T_imu (T, 4, 4) along increments (T-1, 6): the mean of equation 9."""
    return se3.compose(se3.exp(increment), initial_pose)


def back_project(sequence: Sequence, world_T_imu: FloatArray, chosen: np.ndarray | slice = slice(None)) -> FloatArray:
    """Back-projected world points (n, 3), m, of the chosen observations, each from its own disparity (equation 10)."""
    o = sequence.observations
    world_T_cam = world_T_imu @ sequence.imu_T_cam
    return se3.transform(world_T_cam[o.frame[chosen]], sequence.stereo_camera.triangulate(o.pixel[chosen]))
