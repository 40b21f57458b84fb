"""Trajectory files opened: format and columns recognized, each word a number, nothing checked as a path yet.

In plain Python, so that a missing or broken file is reported before numpy is imported. Files are opened all before the
first of them is parsed (`trajectory_reader`).
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

from fgbaseline.geometry import InputError

from .bag_file import is_bag, split_topic
from .columns import Columns, counted_columns, named_columns
from .named_file import FilePath, reading, regular_file, shown
from .number_table import Lines, NumberTable, numbers_of, read_lines
from .wrong_file_type import BAG

TrajectoryFormat = Literal["tum", "kitti", "euroc", "npz"]
ZIP = (b"PK\x03\x04", b"PK\x05\x06")


@dataclass(frozen=True, eq=False, slots=True)
class TrajectoryText:
    """A text file of poses."""

    name: str
    source: str
    """the file it came from"""
    lines: Lines
    columns: Columns
    table: NumberTable
    """numbers of `columns.read`"""
    named: bool
    """whether a header names the columns"""


@dataclass(frozen=True, eq=False, slots=True)
class TrajectoryArchive:
    """An npz file of poses, not read yet."""

    name: str
    source: str
    file: Path


@dataclass(frozen=True, eq=False, slots=True)
class TrajectoryTopic:
    """A topic of a bag (`run.bag:/odom`), not read yet."""

    name: str | None
    bag: Path
    topic: str


OpenedTrajectory = TrajectoryText | TrajectoryArchive | TrajectoryTopic


def open_trajectory(path: FilePath, form: TrajectoryFormat | None = None, name: str | None = None) -> OpenedTrajectory:
    """Opens a trajectory file or a topic of a bag, called `name` (its stem by default); `form` insists on a format.

    Raises InputError naming file and line for a missing file, what is no text, columns of no known format, and a word
    that is no number.
    """
    if form is not None and form not in get_args(TrajectoryFormat):
        raise InputError(f"format: there is no '{form}'; known are {', '.join(get_args(TrajectoryFormat))}")
    if (in_bag := split_topic(path)) is not None:
        return TrajectoryTopic(name, *in_bag)
    with reading(path):
        if Path(path).is_dir() and is_bag(Path(path)):
            raise InputError(BAG)
        file = regular_file(path)
        name = name or file.stem.removesuffix(".txt")
        if form == "npz" or (form is None and _is_zip(file)):
            return TrajectoryArchive(name, shown(path), file)
        lines = read_lines(file)
        lines.require_some("poses")
        columns = named_columns(lines) if form != "kitti" else None
        named = columns is not None
        if columns is None:
            columns = counted_columns(lines, whole=form == "euroc" or _is_whole(lines))
        _require_form(form, lines, columns)
        if form == "euroc":
            columns = replace(columns, unit=columns.unit or "ns")
        table = numbers_of(lines, columns.read, nan=True)
        if columns.nanoseconds is not None:
            numbers_of(lines, [columns.nanoseconds])
        return TrajectoryText(name, shown(path), lines, columns, table, named)


def _is_whole(lines: Lines) -> bool:
    """Whether every stamp in the first column is a whole number, with or without zeros behind its point."""
    parts = (line.split(lines.separator, 1)[0].strip(' \t"').partition(".") for line in lines.text)
    return all(before.isdecimal() and not behind.strip("0") for before, _, behind in parts)


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
