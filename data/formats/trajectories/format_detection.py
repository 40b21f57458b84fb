"""Opens trajectory files: detects format (TUM, EuRoC, KITTI, CSV, npz) and columns, and parses the fields as numbers.

Stamps and poses are checked later (`text_parser`). This module is plain Python, so that a missing or broken
file is reported before numpy is imported. A comparison opens all of its files before it parses the first.
"""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

from fgbaseline.geometry import InputError

from ..files.bag_file import is_bag, split_topic
from ..files.file_errors import FilePath, reading, regular_file, shown
from ..files.number_table import Lines, NumberTable, numbers_of, read_lines
from ..files.wrong_file_type import BAG
from .columns import Columns, counted_columns, named_columns

TrajectoryFormat = Literal["tum", "kitti", "euroc", "npz"]
ZIP = (b"PK\x03\x04", b"PK\x05\x06")


@dataclass(frozen=True, eq=False, slots=True)
class TrajectoryText:
    """Opened text file of poses (TUM, EuRoC, KITTI or another CSV)."""

    name: str
    source: str
    """the file it came from"""
    lines: Lines
    columns: Columns
    table: NumberTable
    """numbers (n, c) in the columns `columns.indices`"""
    has_header: bool
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


def open_named(given: FilePath, form: TrajectoryFormat | None = None) -> OpenedTrajectory:
    """Opens a `[NAME=]FILE`: see `split_name` and `open_trajectory`."""
    name, file = split_name(os.fspath(given))
    return open_trajectory(file, form, name)


def split_name(given: str) -> tuple[str | None, str]:
    """Name and file of `NAME=FILE`; an existing file of that whole name has no name part."""
    name, mark, file = given.partition("=")
    if not mark or Path(given).exists() or "/" in name:
        return None, given
    if not name or not file:
        raise InputError(f"{shown(given)}: expected FILE or NAME=FILE")
    return name, file


def open_trajectory(path: FilePath, form: TrajectoryFormat | None = None, name: str | None = None) -> OpenedTrajectory:
    """Opens a trajectory file, called `name` (its stem by default), or a topic of a bag (without a default name).

    `form` requires that format; it is ignored for a topic of a bag. Raises InputError naming file and line for a
    missing file, a file that is no text, columns of no known format, and a field that is no number.
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
        has_header = columns is not None
        if columns is None:
            columns = counted_columns(lines, whole=form == "euroc" or _is_whole(lines))
        _require_form(form, lines, columns)
        if form == "euroc":
            columns = replace(columns, unit=columns.unit or "ns")
        table = numbers_of(lines, columns.indices, nan=True)
        if columns.nanoseconds is not None:  # only reports a bad field: the exact stamps are taken from the text
            numbers_of(lines, [columns.nanoseconds])
        return TrajectoryText(name, shown(path), lines, columns, table, has_header)


def _is_whole(lines: Lines) -> bool:
    """Whether every stamp in the first column is an integer, possibly written with a zero fraction (`12.000`)."""
    parts = (line.split(lines.separator, 1)[0].strip(' \t"').partition(".") for line in lines.text)
    return all(before.isdecimal() and not behind.strip("0") for before, _, behind in parts)


def _require_form(form: TrajectoryFormat | None, lines: Lines, columns: Columns) -> None:
    """Raises InputError where the columns are not those of the required format."""
    comma = lines.separator is not None
    wrong = {
        "tum": comma or bool(columns.matrix) or columns.time != 0,
        "euroc": not comma or bool(columns.matrix) or columns.time is None,
        "kitti": not columns.matrix,
    }
    expected = {
        "tum": "a TUM line (t tx ty tz qx qy qz qw, separated by spaces)",
        "euroc": "a line of a EuRoC CSV (8 or 17 fields, separated by commas)",
        "kitti": "a KITTI line (12 numbers)",
    }
    if form is not None and wrong.get(form):
        raise InputError(f"line {lines.number[0]}: expected {expected[form]}, got {lines.text[0][:60]!r}")


def _is_zip(file: Path) -> bool:
    with file.open("rb") as opened:
        return opened.read(4).startswith(ZIP)
