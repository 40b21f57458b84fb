"""`read`: a recording in any of the known forms, told apart by what is in the file and never by its name."""

import os
from pathlib import Path

from fgbaseline.geometry import InputError

from ..sequence import Sequence
from .course import read_course
from .named_file import FilePath, reading, regular_file
from .npz_archive import NpzArchive

_KNOWN = "an .npz of the course or of fgbaseline, or a UTIAS .mat"


def read(path: FilePath) -> Sequence:
    """The recording in the file `path`. Raises InputError, naming file, field and value, for anything else."""
    with reading(path):
        return _read(regular_file(path), os.fspath(path))


def _read(file: Path, source: str) -> Sequence:
    with file.open("rb") as opened:
        head = opened.read(1024)
    if not head:
        raise InputError(f"the file is empty; expected {_KNOWN}")
    if head[:4] in (b"PK\x03\x04", b"PK\x05\x06"):
        with NpzArchive(file) as archive:
            return read_course(archive, file.stem, source)
    raise InputError(f"this is no recording; expected {_KNOWN}")
