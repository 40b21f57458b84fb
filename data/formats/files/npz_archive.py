"""Arrays out of a zip of .npy members (`np.savez`), whole or piece by piece."""

import math
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

import numpy as np
from numpy.lib import format as npy

from fgbaseline.geometry import FloatArray, InputError

from .array_stream import ArrayStream, Shape, damage_as_input_error, missing, require_room


class NpzArchive:
    """An open .npz file. Its methods raise InputError naming the key; the caller puts the file's name before it."""

    def __init__(self, path: Path) -> None:
        with damage_as_input_error("zip directory"):
            self._zip = zipfile.ZipFile(path)
        self._members: dict[str, zipfile.ZipInfo] = {}
        try:
            for info in self._zip.infolist():
                self._add(info)
        except InputError:
            self._zip.close()
            raise

    def _add(self, info: zipfile.ZipInfo) -> None:
        parts = info.filename.replace("\\", "/").split("/")
        if parts[0] in ("", "~") or ".." in parts or ":" in parts[0]:
            raise InputError(
                f"the member {info.filename!r} has a name that leads outside the archive; write the file with np.savez"
            )
        key = info.filename.removesuffix(".npy")
        if key in self._members:
            raise InputError(f"{key!r} is in the archive twice; write the file again")
        self._members[key] = info

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._zip.close()

    @property
    def keys(self) -> frozenset[str]:
        """The names of the arrays."""
        return frozenset(self._members)

    @contextmanager
    def stream(self, key: str) -> Iterator[ArrayStream]:
        """The array `key`, to be read piece by piece.

        Raises InputError when the key is missing, the numbers are not real, or the header does not fit the data.
        """
        if key not in self._members:
            raise missing(key, self.keys)
        info = self._members[key]
        with damage_as_input_error(key):
            member = self._zip.open(info)
        with member:
            with damage_as_input_error(key):
                shape, fortran_order, dtype = _read_header(key, member)
                require_room(key, shape, dtype)
                promised = math.prod(shape) * dtype.itemsize
                held = info.file_size - member.tell()
            if promised != held:
                raise InputError(
                    f"{key}: its header promises shape {shape} of {dtype} ({promised} bytes) but the file holds "
                    f"{held} bytes; copy or write the file again"
                )
            yield ArrayStream(key, shape, fortran_order, dtype, member)

    def array(self, key: str) -> FloatArray:
        """The whole array as native float64. Raises as `stream`, and when it is implausibly large."""
        with self.stream(key) as stream:
            return stream.whole()


def _read_header(key: str, member: IO[bytes]) -> tuple[Shape, bool, np.dtype[Any]]:
    major, _ = npy.read_magic(member)
    parse = npy.read_array_header_1_0 if major == 1 else npy.read_array_header_2_0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # files written by Python 2 are readable all the same
        shape, fortran_order, dtype = parse(member)
    if dtype.hasobject:
        raise InputError(f"{key}: it is a pickled array, which is never opened; write plain numbers instead")
    if dtype.kind not in "fiu" or dtype.itemsize > 8:
        raise InputError(f"{key}: it holds {dtype} where real numbers are expected; write float64")
    if any(n < 0 for n in shape):
        raise InputError(f"{key}: its header claims the negative shape {shape}; write the file again")
    return shape, fortran_order, dtype
