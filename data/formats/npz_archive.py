"""Arrays out of a zip of .npy members (`np.savez`), whole or piece by piece, trusting nothing it says of itself."""

import math
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

import numpy as np
from numpy.lib import format as npy

from fgbaseline.geometry import FloatArray, InputError

Shape = tuple[int, ...]
WHOLE_ARRAY_LIMIT = 256 * 2**20
"""bytes: an array that is read whole and claims more than this is a mistake or an attack"""


@contextmanager
def _unzipping(key: str) -> Iterator[None]:
    """zipfile, its decompressors and the header's parser raise a dozen types on damaged input: here they become one."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{key}: the archive is damaged or truncated ({reason}); copy or write it again") from error


@dataclass(frozen=True, slots=True)
class ArrayStream:
    """One member, opened behind its header: `take` gives its values in the order they lie in."""

    key: str
    shape: Shape
    fortran_order: bool
    dtype: np.dtype[Any]
    _member: IO[bytes]

    def take(self, n: int) -> FloatArray:
        """The next n values (n,) as native float64. Raises InputError where the member ends before them."""
        wanted = n * self.dtype.itemsize
        with _unzipping(self.key):
            raw = self._member.read(wanted)
        if len(raw) < wanted:
            raise InputError(
                f"{self.key}: the data end before the shape {self.shape} is filled; copy or write the file again"
            )
        return np.frombuffer(raw, self.dtype).astype(np.float64, copy=False)


class NpzArchive:
    """An open .npz file. Its methods raise InputError naming the key; the caller puts the file's name before it."""

    def __init__(self, path: Path) -> None:
        with _unzipping("zip directory"):
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
            found = ", ".join(repr(k) for k in sorted(self.keys)[:12]) or "nothing"
            raise InputError(f"{key} is missing; the file has {found}")
        info = self._members[key]
        with _unzipping(key):
            member = self._zip.open(info)
        with member:
            with _unzipping(key):
                shape, fortran_order, dtype = _read_header(key, member)
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
            size = math.prod(stream.shape)
            if size * 8 > WHOLE_ARRAY_LIMIT:
                raise InputError(
                    f"{key}: shape {stream.shape} is larger than any recording needs; check how the file was written"
                )
            values = stream.take(size)
            array = values.reshape(stream.shape[::-1]).T if stream.fortran_order else values.reshape(stream.shape)
            return array.copy(order="C")


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
