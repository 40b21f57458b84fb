"""Names and files that a comparison is given. A file is opened, and its faults reported, before numpy is imported."""

import os
from pathlib import Path
from typing import Any, TypeVar, cast

from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data.formats.file_errors import FilePath, shown
from fgbaseline.data.formats.trajectory_opening import OpenedTrajectory, open_trajectory
from fgbaseline.geometry import InputError

Input = TypeVar("Input")


def with_open_file(given: Input, settings: Settings) -> Input | OpenedTrajectory:
    """The opened `[NAME=]FILE`; a trajectory in memory as it is. Raises InputError."""
    if not isinstance(given, str | os.PathLike):
        return given
    name, file = split_name(os.fspath(cast("FilePath", given)))
    return open_trajectory(file, settings.form, name)


def as_path(given: Any) -> Any:
    """A name as a path; anything in memory, and None, as it is."""
    return Path(given) if isinstance(given, str | os.PathLike) else given


def split_name(given: str) -> tuple[str | None, str]:
    """Name and file of `NAME=FILE`; an existing file of that whole name has no name part."""
    name, mark, file = given.partition("=")
    if not mark or Path(given).exists() or "/" in name:
        return None, given
    if not name or not file:
        raise InputError(f"{shown(given)}: expected FILE or NAME=FILE")
    return name, file
