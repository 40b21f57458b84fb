"""Truth of a recording with raw inertial samples: in the axes of its file, from the first frame that has a pose."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ..sequence import Truth


def inertial_truth(poses: FloatArray, source: str) -> Truth:
    """Truth of poses (T, 4, 4) in any world, whose origin is moved to the first known one; its axes are kept.

    A problem ties it to its own world, over the frames that have a pose. Raises InputError where none has.
    """
    world_T_imu = poses.copy()
    known = np.isfinite(poses).all(axis=(1, 2))
    if not known.any():
        raise InputError(f"the ground truth ({source}) has no pose for any frame")
    world_T_imu[:, :3, 3] -= poses[int(np.argmax(known)), :3, 3]
    world_T_imu[~known] = np.nan
    return Truth(world_T_imu, source=source)
