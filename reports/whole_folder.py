"""Folders that appear whole or not at all: built beside their place, then renamed into it."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fgbaseline.geometry import InputError


def require_free(place: Path, *, force: bool, mark: str) -> None:
    """Raises InputError where `place` exists and may not be replaced.

    With `force` an empty folder may be, and one that holds the file `mark`, which says that it is of our making.
    """
    if not place.exists() and not place.is_symlink():
        return
    if not place.is_dir() or place.is_symlink():
        raise InputError(f"{place}: it exists and is no folder; choose another --out")
    if not any(place.iterdir()):
        return
    if not force:
        raise InputError(f"{place}: the folder exists; choose another --out, or replace it with --force")
    if not (place / mark).is_file():
        raise InputError(f"{place}: --force replaces only what an earlier run wrote, and this folder has no {mark}")


@contextmanager
def whole_folder(place: Path, *, force: bool, mark: str) -> Iterator[Path]:
    """A folder to write into that becomes `place` when the block ends well; otherwise nothing is left of it.

    Raises InputError, before the block runs, where `place` may not be written (see `require_free`).
    """
    place = place.absolute()
    require_free(place, force=force, mark=mark)
    building = place.with_name(f".{place.name}.{os.getpid()}.partial")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        building.mkdir()
    except OSError as error:
        raise InputError(f"{place}: cannot be written: {error.strerror or error}") from None
    try:
        yield building
        require_free(place, force=force, mark=mark)
        if place.exists():
            _replace(place, building)
        else:
            building.rename(place)
    except OSError as error:
        raise InputError(f"{place}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(building, ignore_errors=True)


def _replace(place: Path, building: Path) -> None:
    """`building` in place of the folder `place`, which is put back if that fails."""
    old = place.with_name(f".{place.name}.{os.getpid()}.old")
    place.rename(old)
    try:
        building.rename(place)
    except OSError:
        old.rename(place)
        raise
    shutil.rmtree(old, ignore_errors=True)
