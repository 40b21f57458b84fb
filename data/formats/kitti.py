"""KITTI trajectories: the upper three rows of a pose in 12 numbers a line; line k is frame k."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from ..observations import IntArray
from ..time_unit import TimeUnit
from .atomic_write import atomic_write
from .file_errors import FilePath, reading, regular_file
from .number_table import numbers_of, read_lines, require_width
from .stamps import no_unit, possible_units, stamps_of
from .trajectory_checks import require_rising, writable

NUMBERS = 12
ROTATION_TOLERANCE = 1e-3
"""largest error of orthogonality of the nine numbers: files with four digits are within it"""
EXACT = 1e-14
"""error of orthogonality up to which rotations are left unchanged"""


def kitti_poses(values: FloatArray, line: IntArray) -> FloatArray:
    """Poses (n, 4, 4) of the 12 numbers (n, 12) on the lines (n,), their rotations made exact (the nearest one).

    Raises InputError naming the line of a rotation that is off by more than ROTATION_TOLERANCE.
    """
    poses = np.tile(np.eye(4), (len(values), 1, 1))
    poses[:, :3, :] = values.reshape(-1, 3, 4)
    defect = so3.orthogonality_error(poses[:, :3, :3])
    wrong = np.flatnonzero(~(defect <= ROTATION_TOLERANCE))
    if len(wrong):
        i = wrong[0]
        raise InputError(
            f"line {line[i]}: the first three columns are not a rotation (off by {defect[i]:.3g}, allowed "
            f"{ROTATION_TOLERANCE:g}); expected r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z"
        )
    rough = defect > EXACT
    poses[rough, :3, :3] = nearest_rotations(poses[rough, :3, :3])
    return poses


def read_times(path: FilePath, unit: TimeUnit | None = None) -> FloatArray:
    """The stamps (n,), s, strictly rising, of a KITTI `times.txt`: line k is when frame k was taken.

    `unit` is that of stamps whose size does not show it. Raises InputError naming file and line.
    """
    with reading(path), np.errstate(all="ignore"):
        lines = read_lines(regular_file(path))
        require_width(lines, {1: "a time stamp"})
        table = numbers_of(lines)
        stamps = stamps_of(lines.column(0), table.values[:, 0], None)
        require_rising(stamps, table.line)
        units, settled = possible_units(stamps)
        if unit is not None and not settled:
            return stamps.seconds(unit)
        if TimeUnit.S not in units and len(units) != 1:
            several = "its time stamps may be in several units; give --time-unit"
            raise InputError(several if units else f"{no_unit(stamps)}; write seconds")
        return stamps.seconds(units[0])


def write_kitti(path: FilePath, world_T_body: FloatArray) -> None:
    """Writes poses (n, 4, 4) as a KITTI file, all or nothing; `read_kitti` gives them back, positions bit by bit.

    Raises InputError when a pose is missing or no rigid motion (line k is frame k: nothing can be left out), or the
    file cannot be written.
    """
    poses = np.asarray(world_T_body, dtype=np.float64)
    _, kept = writable(np.arange(float(len(poses))), poses)
    if len(kept) < len(poses):
        k = int(np.argmax(np.isnan(poses).all(axis=(1, 2))))
        raise InputError(f"pose {k} is missing, but line k of a KITTI file is frame k; write a TUM file")
    lines = [" ".join(map(repr, row)) for row in poses[:, :3].reshape(-1, NUMBERS).tolist()]
    with atomic_write(path) as file:
        file.write("\n".join([*lines, ""]).encode("ascii"))


def nearest_rotations(matrices: FloatArray) -> FloatArray:
    """The rotations (n, 3, 3) nearest to matrices (n, 3, 3) of positive determinant, in the Frobenius norm (SVD)."""
    U, _, Vt = np.linalg.svd(matrices)
    result: FloatArray = U @ Vt
    return result
