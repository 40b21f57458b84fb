"""TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, in seconds and metres; `#` begins a comment."""

import numpy as np

from fgbaseline.geometry import FloatArray, so3

from .beside import written_beside
from .named_file import FilePath, reading, regular_file
from .number_table import NumberTable, read_numbers
from .stamped_poses import poses_of_quaternions, require_rising, writable

NUMBERS = 8


def read_tum(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s, strictly rising, and poses (n, 4, 4) `world_T_body` of a TUM file.

    Raises InputError naming file and line for what is no number, for quaternions that are not of length 1 (within
    UNIT_TOLERANCE) and for stamps that do not rise.
    """
    with reading(path), np.errstate(all="ignore"):
        return tum_poses(read_numbers(regular_file(path), {NUMBERS: "TUM"}))


def tum_poses(table: NumberTable) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,) and poses (n, 4, 4) of the lines of a TUM file. Raises InputError naming the line."""
    t = table.values[:, 0].copy()
    poses = poses_of_quaternions(
        table.values[:, 1:4], table.values[:, 4:], table.line, "qx qy qz qw of length 1 behind the position"
    )
    require_rising(t, table.line)
    return t, poses


def write_tum(path: FilePath, t: FloatArray, world_T_imu: FloatArray) -> None:
    """Writes stamps (n,), s, and poses (n, 4, 4) as a TUM file, all or nothing; all-NaN poses are left out.

    `read_tum` gives the stamps and positions back bit by bit, the rotations to 1e-14. Raises InputError when a stamp
    does not rise, a pose is no rigid motion, or the file cannot be written.
    """
    stamps, poses = writable(t, world_T_imu)
    rows = np.concatenate([stamps[:, None], poses[:, :3, 3], so3.quaternion_xyzw(poses[:, :3, :3])], axis=1)
    lines = [" ".join(map(repr, row)) for row in rows.tolist()]
    with written_beside(path) as file:
        file.write("\n".join(["# timestamp tx ty tz qx qy qz qw", *lines, ""]).encode("ascii"))
