"""Writes TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, in seconds and meters."""

import numpy as np

from fgbaseline.geometry import FloatArray, so3

from .atomic_write import atomic_write
from .named_file import FilePath
from .stamped_poses import writable


def write_tum(path: FilePath, t: FloatArray, world_T_imu: FloatArray) -> None:
    """Writes stamps (n,), s, and poses (n, 4, 4) as a TUM file, all or nothing; all-NaN poses are left out.

    `read_tum` gives the stamps and positions back bit by bit, the rotations to 1e-14. Raises InputError when a stamp
    does not rise, a pose is no rigid motion, or the file cannot be written.
    """
    stamps, poses = writable(t, world_T_imu)
    rows = np.concatenate([stamps[:, None], poses[:, :3, 3], so3.quaternion_xyzw(poses[:, :3, :3])], axis=1)
    lines = [" ".join(map(repr, row)) for row in rows.tolist()]
    with atomic_write(path) as file:
        file.write("\n".join(["# timestamp [s] tx ty tz qx qy qz qw", *lines, ""]).encode("ascii"))
