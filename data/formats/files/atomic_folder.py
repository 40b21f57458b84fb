"""Atomic writing of folders: built beside their place, then exchanged with it by `renameat2` where the system can."""

import ctypes
import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from fgbaseline.geometry import InputError

_HERE = -100
"""AT_FDCWD: relative paths are relative to the working directory"""
_EXCHANGE = 2
"""RENAME_EXCHANGE"""
_UNABLE = (errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP)
"""error numbers of kernels and file systems without this operation"""


def exchanged(one: Path, other: Path) -> bool:
    """Exchanges the names of two existing paths; False, with nothing changed, if the system cannot.

    Raises OSError if the system supports it and fails.
    """
    rename = _renameat2()
    if rename is None:
        return False
    if rename(_HERE, os.fsencode(one), _HERE, os.fsencode(other), _EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in _UNABLE:
        return False
    raise OSError(code, os.strerror(code), str(one), None, str(other))


@cache
def _renameat2() -> Any:
    """The function of the C library, or None where there is none."""
    try:
        function = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):
        return None
    function.argtypes = [ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_uint]
    return function


def require_free(place: Path, *, force: bool, mark: str) -> None:
    """Raises InputError where `place` exists and may not be replaced, or where no folder can be created.

    `force` allows the replacement of an empty folder, and of one that holds the file `mark`, which our commands write.
    """
    with _refusals(place):
        if not place.exists() and not place.is_symlink():
            _require_room(place)
        elif not place.is_dir() or place.is_symlink():
            raise InputError(f"{place}: it exists and is not a folder; choose another --out")
        elif any(place.iterdir()):
            if not force:
                raise _exists(place)
            if not (place / mark).is_file():
                raise InputError(
                    f"{place}: --force replaces only what an earlier run wrote, and this folder has no {mark}; "
                    "choose another --out"
                )


@contextmanager
def atomic_folder(place: Path, *, force: bool, mark: str) -> Iterator[Path]:
    """Folder to write into that becomes `place` when the block succeeds; otherwise nothing is left of it.

    Raises InputError, before the block runs, where `place` may not be written (see `require_free`).
    """
    place = place.absolute()
    require_free(place, force=force, mark=mark)
    building = place.with_name(f".{place.name}.{os.getpid()}.partial")
    new_parents = [parent for parent in place.parents if not parent.exists()]
    with _refusals(place):
        try:
            building.mkdir(parents=True)
            yield building
            require_free(place, force=force, mark=mark)
            _replace(place, building, force=force, mark=mark)
        finally:
            _remove(building, mark)
            _remove_empty(new_parents)


def _require_room(place: Path) -> None:
    parent = next(parent for parent in place.absolute().parents if parent.exists())
    if not parent.is_dir():
        raise InputError(f"{place}: {parent} is not a folder; choose another --out")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(f"{place}: {parent} may not be written to; choose another --out, or change its permissions")


def _exists(place: Path) -> InputError:
    return InputError(f"{place}: the folder exists; choose another --out, or replace it with --force")


def _replace(place: Path, building: Path, *, force: bool, mark: str) -> None:
    """Gives `building` the name `place`; replaces a folder of that name, which has files, only with `force`.

    The system refuses to rename onto a folder with files: of two processes that write to one place at once, one is
    refused. If the system can exchange two names in one step, `place` is always a complete folder, even if the process
    is killed. Otherwise the old folder is restored if the exchange fails or is interrupted.
    """
    try:
        building.rename(place)
        return
    except OSError as error:
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
            raise
        if not force:
            raise _exists(place) from error
    if exchanged(building, place):  # the old folder now has the temporary name and is removed with it
        return
    old = place.with_name(f".{place.name}.{os.getpid()}.old")
    try:
        place.rename(old)
        building.rename(place)
    finally:
        if not place.exists() and old.exists():
            old.rename(place)
        _remove(old, mark)


def _remove(folder: Path, mark: str) -> None:
    """Removes a folder, its completeness mark first."""
    with suppress(OSError):
        (folder / mark).unlink()
    shutil.rmtree(folder, ignore_errors=True)


def _remove_empty(folders: list[Path]) -> None:
    """Removes empty folders, innermost first."""
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:
            return


@contextmanager
def _refusals(place: Path) -> Iterator[None]:
    """Converts an OSError in the block into an InputError that names the folder."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{place}: the folder cannot be written ({error.strerror or error}); choose another --out"
        ) from error
