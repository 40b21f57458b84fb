"""Resolution of trajectories: differences that the decimals of their files alone can make."""

import numpy as np

from fgbaseline.data import Truth
from fgbaseline.geometry import FloatArray

COARSEST, FINEST = 3, 15
"""decimals of positions in m: a path on whole meters is synthetic rather than rounded to them"""


def decimal_step(position: FloatArray) -> float:
    """Step of coordinates (n, 3): their last decimal, at most 1 mm, or the rounding of floats, m."""
    rounding = 4.0 * float(np.spacing(np.abs(position).max(initial=1.0)))
    for decimals in range(COARSEST, FINEST + 1):
        if np.all(np.abs(position - np.round(position, decimals)) <= rounding):
            return max(10.0**-decimals, rounding)
    return rounding


def truth_resolution(truth: Truth | None) -> float:
    """Largest distance that the decimals of ground truth alone can make, m; 0 without ground truth."""
    if truth is None or not truth.known.any():
        return 0.0
    return 0.5 * float(np.sqrt(3.0)) * decimal_step(truth.world_T_imu[truth.known, :3, 3])


def position_resolution(position: FloatArray, other: FloatArray) -> float:
    """Largest distance that the rounding of two positions, each by half a step of its path (n, 3), makes, m."""
    return 0.5 * float(np.sqrt(3.0)) * (decimal_step(position) + decimal_step(other))


def rotation_resolution_deg(position: FloatArray, other: FloatArray) -> float:
    """Largest angle that rounding makes, degrees, where quaternions have as many decimals as the positions.

    A quaternion is half an angle, and half a step in each of four components is at most a step.
    """
    return 2.0 * float(np.rad2deg(decimal_step(position) + decimal_step(other)))
