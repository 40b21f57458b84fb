"""Array in a file, read piece by piece after its header, without trust in what the header claims."""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

Shape = tuple[int, ...]
WHOLE_ARRAY_LIMIT = 256 * 2**20
"""bytes; a larger claim of an array that is read whole is a mistake or an attack"""


class Readable(Protocol):
    """Sequential bytes: a file, a member of an archive, or a compressed element."""

    def read(self, n: int, /) -> bytes:
        """The next n bytes; fewer only at the end."""
        ...


@contextmanager
def damage_as_input_error(key: str) -> Iterator[None]:
    """Converts the many exceptions of parsers and decompressors on damaged input into one InputError."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{key}: the file is damaged or truncated ({reason}); copy or write it again") from error


def missing(key: str, keys: frozenset[str]) -> InputError:
    """InputError for an array that is missing among the `keys` of a file."""
    found = ", ".join(repr(k) for k in sorted(keys)[:16]) or "nothing"
    return InputError(f"{key} is missing; the file has {found}")


def require_room(key: str, shape: Shape, dtype: np.dtype[Any], memory: int | None = None) -> None:
    """Raises InputError, with its size, for an array that claims more bytes than the machine's memory (`memory`).

    Such an array would be read piece by piece and not held. But a feature block of that size is a mistake or an attack,
    and its zeros may be compressed into a small file that takes hours to read.
    """
    memory = _machine_memory() if memory is None else memory
    claimed = math.prod(shape) * dtype.itemsize
    if memory is not None and claimed > memory:
        raise InputError(
            f"{key}: its header promises shape {shape} of {dtype}, which is {claimed / 1e9:,.1f} GB, more than the "
            f"{memory / 1e9:.1f} GB of memory of this machine; check how the file was written"
        )


def _machine_memory() -> int | None:
    """Memory of this machine, bytes; None where the system does not report it."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None


@dataclass(frozen=True, slots=True)
class ArrayStream:
    """Array opened after its header; `take` returns its values in storage order."""

    key: str
    shape: Shape
    fortran_order: bool
    dtype: np.dtype[Any]
    source: Readable

    def take(self, n: int) -> FloatArray:
        """The next n values (n,) as native float64. Raises InputError where the data end before them."""
        wanted = n * self.dtype.itemsize
        with damage_as_input_error(self.key):
            raw = self.source.read(wanted)
        if len(raw) < wanted:
            raise InputError(
                f"{self.key}: the data end before the shape {self.shape} is filled; copy or write the file again"
            )
        return np.frombuffer(raw, self.dtype).astype(np.float64, copy=False)

    def whole(self) -> FloatArray:
        """The whole array as native float64 in C order. Raises InputError when it is implausibly large."""
        size = math.prod(self.shape)
        if size * 8 > WHOLE_ARRAY_LIMIT:
            raise InputError(
                f"{self.key}: shape {self.shape} is larger than any recording needs; check how the file was written"
            )
        values = self.take(size)
        array = values.reshape(self.shape[::-1]).T if self.fortran_order else values.reshape(self.shape)
        return array.copy(order="C")
