"""Array of an npz file, byte-identical for equal numbers because no time of writing is stored."""

import zipfile
from collections.abc import Iterable

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""the earliest stamp a zip can carry"""
_UNIX = 3
_MODE = 0o600 << 16


def write_member(
    archive: zipfile.ZipFile,
    key: str,
    shape: tuple[int, ...],
    chunks: Iterable[NDArray[np.generic]],
    form: str = "<f8",
) -> None:
    """The array `key` in C order, given as consecutive pieces; `form` is numpy's name of its numbers, such as `<i8`."""
    info = zipfile.ZipInfo(f"{key}.npy", _EPOCH)
    info.compress_type = zipfile.ZIP_DEFLATED
    info.create_system, info.external_attr = _UNIX, _MODE
    with archive.open(info, "w", force_zip64=True) as member:
        npy.write_array_header_1_0(member, {"descr": form, "fortran_order": False, "shape": shape})
        for chunk in chunks:
            member.write(np.ascontiguousarray(chunk, dtype=form).tobytes())
