"""Poses between poses."""

from dataclasses import replace

import numpy as np

from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, so3


def interpolated(path: Trajectory, t: FloatArray) -> Trajectory:
    """The path at stamps t (n,), s, within its own: positions on straight lines, rotations by SLERP (shortest way).

    At a stamp of the path it is that pose, bit by bit. Raises ValueError outside of the path, where nothing is known.
    """
    if len(t) and (t[0] < path.t[0] or t[-1] > path.t[-1]):
        raise ValueError("a path cannot be interpolated beyond its ends")
    after = np.clip(np.searchsorted(path.t, t, side="left"), 1, len(path) - 1)
    before = after - 1
    share = (t - path.t[before]) / (path.t[after] - path.t[before])
    poses = np.array(path.world_T_body[np.where(share == 1.0, after, before)])
    between = np.flatnonzero((share > 0.0) & (share < 1.0))
    a, b, s = before[between], after[between], share[between, None]
    turn = so3.log_so3(np.swapaxes(path.rotation[a], 1, 2) @ path.rotation[b])
    poses[between, :3, :3] = path.rotation[a] @ so3.exp_so3(s * turn)
    poses[between, :3, 3] = path.position[a] + s * (path.position[b] - path.position[a])
    return replace(path, t=t, world_T_body=poses, line=None)
