"""TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, in seconds and metres; `#` begins a comment."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from .beside import written_beside
from .named_file import FilePath, reading, regular_file
from .number_table import NumberTable, read_numbers

NUMBERS = 8
UNIT_TOLERANCE = 1e-3
"""how far from 1 the length of a quaternion may be: files with four decimals are within it; it is made exact here"""
ROTATION_TOLERANCE = 1e-6


def read_tum(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s, strictly rising, and poses (n, 4, 4) `world_T_body` of a TUM file.

    Raises InputError naming file and line for what is no number, for quaternions that are not of length 1 (within
    UNIT_TOLERANCE) and for stamps that do not rise.
    """
    with reading(path), np.errstate(all="ignore"):
        return tum_poses(read_numbers(regular_file(path), {NUMBERS: "TUM"}))


def tum_poses(table: NumberTable) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,) and poses (n, 4, 4) of the lines of a TUM file. Raises InputError naming the line."""
    t, quaternion = table.values[:, 0].copy(), table.values[:, 4:]
    length = np.linalg.norm(quaternion, axis=1)
    wrong = np.flatnonzero(~(np.abs(length - 1.0) <= UNIT_TOLERANCE))
    if len(wrong):
        i = wrong[0]
        raise InputError(
            f"line {table.line[i]}: the quaternion {quaternion[i].tolist()} has length {length[i]:.6g}; "
            "expected qx qy qz qw of length 1 behind the position"
        )
    late = np.flatnonzero(~(np.diff(t) > 0))
    if len(late):
        i = late[0] + 1
        raise InputError(
            f"line {table.line[i]}: the time stamp {float(t[i])!r} is not after {float(t[i - 1])!r} "
            f"(line {table.line[i - 1]}); sort the lines and remove repeated ones"
        )
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, :3, 3] = table.values[:, 1:4]
    poses[:, :3, :3] = so3.rotation_from_quaternion(quaternion)
    return t, poses


def write_tum(path: FilePath, t: FloatArray, world_T_imu: FloatArray) -> None:
    """Writes stamps (n,), s, and poses (n, 4, 4) as a TUM file, all or nothing; all-NaN poses are left out.

    `read_tum` gives the stamps and positions back bit by bit, the rotations to 1e-14. Raises InputError when a stamp
    does not rise, a pose is no rigid motion, or the file cannot be written.
    """
    poses = np.asarray(world_T_imu, dtype=np.float64)
    stamps = np.asarray(t, dtype=np.float64)
    if stamps.ndim != 1 or poses.shape != (len(stamps), 4, 4):
        raise InputError(f"a trajectory needs stamps (n,) and poses (n, 4, 4), not {stamps.shape} and {poses.shape}")
    known = ~np.isnan(poses).all(axis=(1, 2))
    stamps, poses = stamps[known], poses[known]
    _require_trajectory(stamps, poses)
    rows = np.concatenate([stamps[:, None], poses[:, :3, 3], so3.quaternion_xyzw(poses[:, :3, :3])], axis=1)
    lines = [" ".join(map(repr, row)) for row in rows.tolist()]
    with written_beside(path) as file:
        file.write("\n".join(["# timestamp tx ty tz qx qy qz qw", *lines, ""]).encode("ascii"))


def _require_trajectory(t: FloatArray, poses: FloatArray) -> None:
    if not np.isfinite(t).all() or np.any(np.diff(t) <= 0):
        raise InputError("the time stamps of a trajectory must be finite and rise")
    finite = np.isfinite(poses).all(axis=(1, 2))
    defect = np.full(len(t), np.inf)
    defect[finite] = so3.rotation_defect(poses[finite, :3, :3])
    if len(t) and defect.max() > ROTATION_TOLERANCE:
        i = int(defect.argmax())
        raise InputError(f"pose {i} (at {float(t[i])!r} s) is no rigid motion (rotation off by {defect[i]:.3g})")
