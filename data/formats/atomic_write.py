"""Atomic writing of files: to a temporary file in the same folder, which is then renamed."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from fgbaseline.geometry import InputError

from .named_file import FilePath, shown, writing


@contextmanager
def atomic_write(path: FilePath) -> Iterator[IO[bytes]]:
    """Binary file that becomes `path` when the block succeeds; otherwise `path` is unchanged.

    Raises InputError naming the file when it cannot be written.
    """
    place = Path(path)
    if place.name in ("", ".."):
        raise InputError(f"{shown(path)}: this is a folder; give the name of a file to write")
    part = place.with_name(f".{place.name}.{os.getpid()}.part")
    with writing(path):
        try:
            with part.open("wb") as file:
                yield file
            part.replace(place)
        finally:
            part.unlink(missing_ok=True)
