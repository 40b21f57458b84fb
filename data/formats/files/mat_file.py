"""Real arrays out of a MATLAB 5 file, whole or piece by piece.

Layout: "MAT-File Format", The MathWorks, chapter 1. After 128 bytes of header come elements of a tag (type, number
of bytes) and data padded to 8 bytes. A variable is an element of type 14, or one of type 15 that holds it compressed;
its sub-elements are flags, dimensions, name and numbers. Only dense real arrays are opened. (`scipy.io.loadmat` reads
these files too, but one wrong byte in them makes it take the interpreter down.)
"""

import io
import math
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from .array_stream import ArrayStream, Readable, Shape, damage_as_input_error, missing, require_room

HEADER = 128
STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""storage types of numbers in the file, whatever the class of the variable"""
INT8, INT32, UINT32, MATRIX, COMPRESSED = 1, 5, 6, 14, 15
DENSE_CLASSES = range(6, 16)
"""double, single and the integers; what is below are cells, structures, objects, texts and sparse matrices"""
COMPLEX = 0x0800
SMALL_PART = 1024
"""bytes: flags, dimensions and names are shorter than this"""


class _Slice:
    """The next n bytes of a file."""

    def __init__(self, file: Readable, n: int) -> None:
        self._file, self._left = file, n

    def read(self, n: int, /) -> bytes:
        raw = self._file.read(min(n, self._left))
        self._left -= len(raw)
        return raw


class _Inflated:
    """Unpacked bytes; their end is reached only if the checksum holds."""

    def __init__(self, packed: Readable) -> None:
        self._packed, self._zlib = packed, zlib.decompressobj()

    def read(self, n: int, /) -> bytes:
        pieces = []
        while n > 0 and not self._zlib.eof:
            packed = self._zlib.unconsumed_tail or self._packed.read(2**16)
            piece = self._zlib.decompress(packed, n)
            if not packed and not piece:
                raise EOFError("the compressed data end early")
            pieces.append(piece)
            n -= len(piece)
        return b"".join(pieces)


@dataclass(frozen=True, slots=True)
class _Variable:
    offset: int
    n_bytes: int
    compressed: bool
    shape: Shape
    flags: int


class MatFile:
    """An open MATLAB 5 file. Its methods raise InputError naming the variable; the caller adds the file's name."""

    def __init__(self, path: Path) -> None:
        self._file: IO[bytes] = path.open("rb")
        try:
            with damage_as_input_error("MATLAB header"):
                self._order = "<" if self._file.read(HEADER)[-2:] == b"IM" else ">"
                self._variables = dict(self._scan(path.stat().st_size))
        except InputError:
            self._file.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def keys(self) -> frozenset[str]:
        """The names of the variables."""
        return frozenset(self._variables)

    def shape(self, key: str) -> Shape:
        """The shape of a variable; it has at least two axes. Raises InputError when it is missing."""
        if key not in self._variables:
            raise missing(key, self.keys)
        return self._variables[key].shape

    @contextmanager
    def stream(self, key: str) -> Iterator[ArrayStream]:
        """The variable `key`, to be read piece by piece, from the first value to the last.

        Raises InputError when it is missing, no dense array of real numbers, or its data do not fit its shape.
        """
        shape, variable = self.shape(key), self._variables[key]
        if variable.flags & 0xFF not in DENSE_CLASSES or variable.flags & COMPLEX:
            raise InputError(f"{key}: it is not a dense array of real numbers; save it as double")
        with damage_as_input_error(key):
            source = self._open(variable)
            self._head(source)
            stored, n_bytes, inline = self._tag(source)
            dtype = np.dtype(self._order + STORED[stored])
            require_room(key, shape, dtype)
        if math.prod(shape) * dtype.itemsize != n_bytes:
            raise InputError(f"{key}: {n_bytes} bytes of {dtype} do not fill the shape {shape}; save the file again")
        yield ArrayStream(key, shape, True, dtype, source if inline is None else io.BytesIO(inline))
        with damage_as_input_error(key):
            source.read(8)  # the padding, and with it the end and its checksum

    def array(self, key: str) -> FloatArray:
        """The whole variable as native float64. Raises as `stream`, and when it is implausibly large."""
        with self.stream(key) as stream:
            return stream.whole()

    def _scan(self, size: int) -> Iterator[tuple[str, _Variable]]:
        """Every named variable of the file, by its head."""
        offset = HEADER
        while offset < size:
            self._file.seek(offset)
            kind, n_bytes, inline = self._tag(self._file)
            offset += 8
            if kind not in (MATRIX, COMPRESSED) or inline is not None or offset + n_bytes > size:
                raise ValueError(f"no whole variable at byte {offset - 8}")
            variable = _Variable(offset, n_bytes, kind == COMPRESSED, (), 0)
            flags, shape, name = self._head(self._open(variable))
            yield name, _Variable(offset, n_bytes, kind == COMPRESSED, shape, flags)
            offset += n_bytes

    def _open(self, variable: _Variable) -> Readable:
        """The sub-elements of a variable."""
        self._file.seek(variable.offset)
        packed = _Slice(self._file, variable.n_bytes)
        if not variable.compressed:
            return packed
        source = _Inflated(packed)
        kind, _, _ = self._tag(source)
        if kind != MATRIX:
            raise ValueError(f"element type {kind} in place of a variable")
        return source

    def _head(self, source: Readable) -> tuple[int, Shape, str]:
        """Flags, dimensions and name of a variable; `source` then stands before its numbers."""
        flags = np.frombuffer(self._part(source, UINT32), self._order + "u4")
        dimensions = np.frombuffer(self._part(source, INT32), self._order + "i4").tolist()
        name = self._part(source, INT8).decode("ascii")
        if len(flags) != 2 or len(dimensions) < 2 or min(dimensions) < 0:
            raise ValueError(f"flags {flags.tolist()} and dimensions {dimensions} of {name!r}")
        return int(flags[0]), tuple(dimensions), name

    def _part(self, source: Readable, expected: int) -> bytes:
        kind, n_bytes, inline = self._tag(source)
        if kind != expected or n_bytes > SMALL_PART:
            raise ValueError(f"element of type {kind} and {n_bytes} bytes in place of type {expected}")
        if inline is not None:
            return inline
        return _exactly(source, n_bytes + -n_bytes % 8)[:n_bytes]

    def _tag(self, source: Readable) -> tuple[int, int, bytes | None]:
        """Type and size, in bytes, of the next element, and the data of a small element, whose tag contains them."""
        raw = _exactly(source, 8)
        first, second = np.frombuffer(raw, self._order + "u4").tolist()
        if first >> 16:
            n_bytes = first >> 16
            if n_bytes > 4:
                raise ValueError(f"a small element of {n_bytes} bytes")
            return first & 0xFFFF, n_bytes, raw[4 : 4 + n_bytes]
        return first, second, None


def _exactly(source: Readable, n: int) -> bytes:
    raw = source.read(n)
    if len(raw) < n:
        raise EOFError("the file ends early")
    return raw
