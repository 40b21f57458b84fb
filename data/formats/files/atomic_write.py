"""Atomic writing of files: to a temporary file in the same folder, which is then renamed."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from fgbaseline.geometry import InputError

from .file_errors import FilePath, shown, writing

_EXISTS = "the file exists; choose another, or replace it with --force"
_NO_LINKS = (errno.EPERM, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""error numbers of file systems without hard links"""


def require_new(path: FilePath, *, force: bool) -> None:
    """Raises InputError where `path` exists, unless `force` allows its replacement."""
    if not force and os.path.lexists(path):
        raise InputError(f"{shown(path)}: {_EXISTS}")


@contextmanager
def atomic_write(path: FilePath, *, force: bool = True) -> Iterator[IO[bytes]]:
    """Binary file that becomes `path` when the block succeeds; otherwise `path` is unchanged.

    Without `force` no existing file is replaced: of several processes that write one file, only the first succeeds.
    Raises InputError naming the file when it cannot be written.
    """
    require_new(path, force=force)
    place = Path(path)
    if place.name in ("", ".."):
        raise InputError(f"{shown(path)}: this is a folder; give the name of a file to write")
    part = place.with_name(f".{place.name}.{os.getpid()}.part")
    with writing(path):
        try:
            with part.open("wb") as file:
                yield file
            if force:
                part.replace(place)
            else:
                _rename_to_new(part, place)
        finally:
            part.unlink(missing_ok=True)


def _rename_to_new(part: Path, place: Path) -> None:
    """Gives a file a name that no other file has.

    A hard link, unlike a rename, is refused where the name is taken.
    """
    try:
        try:
            os.link(part, place)
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            # FAT and its kind: an empty file reserves the name, and is seen until the rename
            place.open("xb").close()
            part.replace(place)
    except FileExistsError as error:
        raise InputError(_EXISTS) from error
