"""Writes TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, in seconds and meters."""

import numpy as np

from fgbaseline.geometry import FloatArray, so3

from .atomic_write import atomic_write
from .named_file import FilePath
from .stamped_poses import writable


def write_tum(path: FilePath, t: FloatArray, world_T_imu: FloatArray, up: FloatArray | None = None) -> None:
    """Writes stamps (n,), s, and poses (n, 4, 4) as a TUM file, all or nothing; all-NaN poses are left out.

    `up` (3,), the unit vector that points up in the world, is written as the comment `# up x y z`, which a comparison
    reads. `read_tum` gives the stamps and positions back bit by bit, the rotations to 1e-14. Raises InputError when a
    stamp does not rise, a pose is no rigid motion, or the file cannot be written.
    """
    stamps, poses = writable(t, world_T_imu)
    rows = np.concatenate([stamps[:, None], poses[:, :3, 3], so3.quaternion_xyzw(poses[:, :3, :3])], axis=1)
    lines = [" ".join(map(repr, row)) for row in rows.tolist()]
    with atomic_write(path) as file:
        file.write("\n".join(["# timestamp [s] tx ty tz qx qy qz qw", *_up_comment(up), *lines, ""]).encode("ascii"))


def _up_comment(up: FloatArray | None) -> list[str]:
    return [] if up is None else [" ".join(["# up", *map(repr, np.asarray(up, dtype=np.float64).tolist())])]
