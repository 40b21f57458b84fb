"""`read_trajectory`: a trajectory in any of the known forms, told apart by what is in the file."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple, get_args

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ..observations import IntArray
from ..trajectory import Trajectory
from . import euroc, kitti, tum
from .named_file import FilePath, reading, regular_file, shown
from .number_table import Lines, numbers_of, read_lines
from .trajectory_npz import read_trajectory_npz

TrajectoryFormat = Literal["tum", "kitti", "euroc", "npz"]
ZIP = (b"PK\x03\x04", b"PK\x05\x06")


class _Read(NamedTuple):
    t: FloatArray | None
    """None where the file has no time stamps"""
    poses: FloatArray
    line: IntArray | None


def read_trajectory(
    path: FilePath, form: TrajectoryFormat | None = None, times: FloatArray | None = None, name: str | None = None
) -> Trajectory:
    """The trajectory in a TUM, KITTI, EuRoC or npz file, called `name` (the file's stem by default).

    The form is told from the content; `form` insists on one. KITTI files have no time stamps: line k is taken at
    `times[k]`, s (see `read_times`); without times it is frame k, and the trajectory is not `stamped`. A file of
    another form has stamps of its own, and `times` is not looked at. Raises InputError naming file and line (or pose)
    for a wrong count, what is no number, NaN, stamps that repeat or are not sorted, and poses that are no rigid motion.
    """
    if form is not None and form not in get_args(TrajectoryFormat):
        raise InputError(f"format: there is no '{form}'; known are {', '.join(get_args(TrajectoryFormat))}")
    with reading(path), np.errstate(all="ignore"):
        file = regular_file(path)
        read = _read(file, form)
        t, stamped = read.t, True
        if t is None:
            t, stamped = _frame_times(len(read.poses), times)
    return Trajectory(t, read.poses, name or file.stem, shown(path), read.line, stamped)


def read_pose_covariances(path: FilePath) -> FloatArray | None:
    """The covariances (n, 6, 6) of the poses of an npz trajectory; None for files that have none.

    They are those of the right perturbation [v, w], m and rad, one for each pose that `read_trajectory` gives.
    """
    with reading(path), np.errstate(all="ignore"):
        file = regular_file(path)
        return read_trajectory_npz(file)[2] if _is_zip(file) else None


def _read(file: Path, form: TrajectoryFormat | None) -> _Read:
    if form == "npz" or (form is None and _is_zip(file)):
        t, poses, _ = read_trajectory_npz(file)
        return _Read(t, poses, None)
    lines = read_lines(file)
    return _READERS[form or _form(lines)](lines)


def _tum(lines: Lines) -> _Read:
    table = numbers_of(lines, {tum.NUMBERS: "TUM"})
    t, poses = tum.tum_poses(table)
    return _Read(t, poses, table.line)


def _kitti(lines: Lines) -> _Read:
    table = numbers_of(lines, {kitti.NUMBERS: "KITTI"})
    return _Read(None, kitti.kitti_poses(table), table.line)


def _euroc(lines: Lines) -> _Read:
    t, poses = euroc.euroc_poses(lines)
    return _Read(t, poses, np.array(lines.number, dtype=np.int64))


_READERS: dict[str, Callable[[Lines], _Read]] = {"tum": _tum, "kitti": _kitti, "euroc": _euroc}


def _form(lines: Lines) -> TrajectoryFormat:
    """By the first line: words between commas, or how many there are between blanks."""
    if lines.separator == ",":
        return "euroc"
    if lines.width == tum.NUMBERS:
        return "tum"
    if lines.width == kitti.NUMBERS:
        return "kitti"
    raise InputError(
        f"line {lines.number[0]}: it has {lines.width} words, but a line has 8 numbers in a TUM file, 12 in a KITTI "
        "file and 8 or 17 between commas in a EuRoC file"
    )


def _frame_times(n: int, times: FloatArray | None) -> tuple[FloatArray, bool]:
    """Stamps (n,) for n poses without any, and whether they are times."""
    if times is None:
        return np.arange(float(n)), False
    if len(times) < n:
        raise InputError(f"it has {n} poses, but there are only {len(times)} time stamps; give those of this recording")
    return times[:n], True


def _is_zip(file: Path) -> bool:
    with file.open("rb") as opened:
        return opened.read(4).startswith(ZIP)
