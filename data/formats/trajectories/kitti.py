"""KITTI files are read and written: poses, 12 numbers a line, where line k is frame k; and the stamps of frames."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...time_unit import TimeUnit
from ...wording import plural
from ..files.atomic_write import atomic_write
from ..files.file_errors import FilePath, reading, regular_file
from ..files.number_table import numbers_of, read_lines, require_width
from ..stamps.file_stamps import no_unit, possible_units, stamps_of
from .checks import require_rising, writable
from .reader import read_trajectory

NUMBERS = 12


def read_kitti(path: FilePath) -> FloatArray:
    """Poses (n, 4, 4) `world_T_body` of a KITTI file; see `read_trajectory`."""
    return read_trajectory(path, "kitti").world_T_body


def read_extrinsic(path: FilePath) -> FloatArray:
    """Pose (4, 4) of the left camera in the IMU frame, from one line of 12 numbers. Raises InputError."""
    with reading(path):
        text = regular_file(path).read_text("utf-8-sig", errors="replace")
        lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
        n_words = len(lines[0].replace(",", " ").split()) if lines else 0
        if len(lines) != 1 or n_words != 12:
            got = plural(len(lines), "line") if len(lines) != 1 else f"a line of {n_words}"
            raise InputError(f"expected imu_T_cam in one line of 12 numbers, got {got}")
    poses = read_kitti(path)
    return np.asarray(poses[0], dtype=np.float64)


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
