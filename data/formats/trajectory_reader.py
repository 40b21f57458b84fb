"""Reader of trajectories in all known formats, detected from the content and never from the file name."""

from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ..time_unit import TimeUnit
from ..trajectory import Trajectory
from .columns import Columns, Order, counted_columns, named_columns
from .named_file import FilePath, reading, regular_file, shown
from .number_table import Lines, read_lines
from .parsed_trajectory import ParsedTrajectory, unit_and_order
from .stamps import possible_units, stamps_of
from .trajectory_from_text import read_text
from .trajectory_npz import read_trajectory_npz

TrajectoryFormat = Literal["tum", "kitti", "euroc", "npz"]
ZIP = (b"PK\x03\x04", b"PK\x05\x06")


def read_trajectory(
    path: FilePath,
    form: TrajectoryFormat | None = None,
    times: FloatArray | None = None,
    name: str | None = None,
    *,
    time_unit: TimeUnit | None = None,
    quaternion: Order | None = None,
) -> Trajectory:
    """The trajectory in a TUM, KITTI, EuRoC or npz file, or another CSV, called `name` (the file's stem by default).

    The format is detected from the content; `form` insists on one. KITTI files have no time stamps: line k is taken at
    `times[k]`, s (see `read_times`); without times it is frame k, and the trajectory is not `stamped`. A file of
    another format has stamps of its own, and `times` is not looked at. `time_unit` and `quaternion` settle what the
    file leaves open. Raises InputError naming file and line (or pose) for a wrong count, what is no number, stamps that
    are not sorted or lost their digits, and poses that are no rigid motion.
    """
    file = read_trajectory_file(path, form, name)
    return file.trajectory(
        *unit_and_order(file, time_unit, quaternion), () if times is None else (times[: max(len(file.position), 1)],)
    )


def read_pose_covariances(path: FilePath) -> FloatArray | None:
    """The covariances (n, 6, 6) of the poses of a trajectory file; None for files that have none.

    They are those of the right perturbation [v, w], m and rad, one for each pose that `read_trajectory` gives.
    """
    return read_trajectory_file(path).covariance()


def read_tum(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s as they stand, strictly rising, and poses (n, 4, 4) `world_T_body` of a TUM file.

    Raises as `read_trajectory`.
    """
    read = read_trajectory_file(path, "tum").trajectory(TimeUnit.S, "xyzw")
    return read.t, read.world_T_body


def read_euroc(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s, strictly rising, and poses (n, 4, 4) `world_T_body` of a EuRoC CSV.

    Raises as `read_trajectory`, and for stamps that are no whole nanoseconds.
    """
    read = read_trajectory(path, "euroc")
    return read.t, read.world_T_body


def read_kitti(path: FilePath) -> FloatArray:
    """Poses (n, 4, 4) `world_T_body` of a KITTI file; see `read_trajectory`."""
    return read_trajectory(path, "kitti").world_T_body


def read_trajectory_file(
    path: FilePath, form: TrajectoryFormat | None = None, name: str | None = None
) -> ParsedTrajectory:
    """Parsed trajectory file, with what it leaves open. Raises as `read_trajectory`."""
    if form is not None and form not in get_args(TrajectoryFormat):
        raise InputError(f"format: there is no '{form}'; known are {', '.join(get_args(TrajectoryFormat))}")
    with reading(path), np.errstate(all="ignore"):
        file = regular_file(path)
        empty = ParsedTrajectory(name or file.stem.removesuffix(".txt"), shown(path), np.empty((0, 3)), None)
        if form == "npz" or (form is None and _is_zip(file)):
            return _of_npz(empty, file)
        lines = read_lines(file)
        lines.require_some()
        columns = named_columns(lines) if form != "kitti" else None
        named = columns is not None
        if columns is None:
            columns = counted_columns(lines, whole=form == "euroc" or _is_whole(lines))
        _require_form(form, lines, columns)
        if form == "euroc":
            columns = replace(columns, unit=columns.unit or "ns")
        read = read_text(empty, lines, columns)
        if named or len(read.orders) == 1 or (lines.separator is None and lines.width in (8, 9, 20, 44)):
            return read
        order = " ".join(read.orders[0])
        return replace(read, remarks=(*read.remarks, f"no header names the order of its quaternions; {order} is usual"))


def _of_npz(empty: ParsedTrajectory, file: Path) -> ParsedTrajectory:
    t, poses, covariance, remarks = read_trajectory_npz(file)
    stamps = stamps_of([repr(stamp) for stamp in t.tolist()], t, None)
    units, is_known = possible_units(stamps)
    return replace(
        empty,
        position=poses[:, :3, 3],
        rotation=poses[:, :3, :3],
        stamps=stamps,
        units=units,
        unit_known=is_known,
        covariance_numbers=covariance,
        remarks=tuple(remarks),
    )


def _is_whole(lines: Lines) -> bool:
    word = lines.words(0)[0]
    return word.partition(".")[0].isdecimal() and not word.partition(".")[2].strip("0")


def _require_form(form: TrajectoryFormat | None, lines: Lines, columns: Columns) -> None:
    """Raises InputError where the columns are not those of the format that is insisted on."""
    comma = lines.separator is not None
    wrong = {
        "tum": comma or bool(columns.matrix) or columns.time != 0,
        "euroc": not comma or bool(columns.matrix) or columns.time is None,
        "kitti": not columns.matrix,
    }
    expected = {
        "tum": "8 numbers (TUM) between blanks",
        "euroc": "8 or 17 numbers (EuRoC) between commas",
        "kitti": "12 numbers (KITTI)",
    }
    if form is not None and wrong.get(form):
        raise InputError(f"line {lines.number[0]}: expected {expected[form]}, got {lines.text[0][:60]!r}")


def _is_zip(file: Path) -> bool:
    with file.open("rb") as opened:
        return opened.read(4).startswith(ZIP)
