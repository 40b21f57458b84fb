"""Error messages with the file name: readers report the fault of a field, and the name is prepended here."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fgbaseline.geometry import InputError

FilePath = str | os.PathLike[str]


def as_path(given: Any) -> Any:
    """A name as a path; anything in memory, and None, as it is."""
    return Path(given) if isinstance(given, str | os.PathLike) else given


def shown(path: FilePath) -> str:
    """Path as printable text on one line."""
    text = os.fspath(path).encode("utf-8", "backslashreplace").decode()
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


@contextmanager
def reading(path: FilePath) -> Iterator[None]:
    """Converts an InputError or OSError in the block into one InputError that begins with the file name, once."""
    with _naming(path, "it cannot be read", "check the path and its permissions"):
        yield


@contextmanager
def writing(path: FilePath) -> Iterator[None]:
    """Same as `reading`, for a file being written."""
    with _naming(path, "it cannot be written", "check the folder, its permissions and the space left"):
        yield


@contextmanager
def _naming(path: FilePath, failure: str, advice: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        if str(error).startswith(f"{shown(path)}: "):
            raise
        raise InputError(f"{shown(path)}: {error}") from error
    except OSError as error:
        raise InputError(f"{shown(path)}: {failure} ({error.strerror or error}); {advice}") from error


def regular_file(path: FilePath) -> Path:
    """Path of an ordinary file. Raises InputError (without the name: see `reading`) or OSError."""
    file = Path(path)
    try:
        found = file.exists()
    except ValueError as error:  # a null byte within the name
        raise InputError(f"there can be no file of this name ({error}); check the path") from error
    if not found:
        raise InputError("there is no such file; check the path")
    if file.is_dir():
        raise InputError("this is a folder; give a file")
    if not file.is_file():
        raise InputError("this is not an ordinary file; give a file")
    return file
