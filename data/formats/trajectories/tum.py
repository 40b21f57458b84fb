"""TUM files are read and written: `timestamp tx ty tz qx qy qz qw` a line, s and m.

`format_detection` detects the format of any trajectory, TUM included; `text_parser` parses all text
formats.
"""

import numpy as np

from fgbaseline.geometry import FloatArray, so3

from ...time_unit import TimeUnit
from ..files.atomic_write import atomic_write
from ..files.file_errors import FilePath
from .checks import writable
from .reader import read_trajectory_file


def read_tum(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s, unchanged and strictly rising, and poses (n, 4, 4) `world_T_body` of a TUM file.

    Raises as `read_trajectory`.
    """
    read = read_trajectory_file(path, "tum").trajectory(TimeUnit.S, "xyzw")
    return read.t, read.world_T_body


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
