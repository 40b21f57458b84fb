"""Real arrays out of a MATLAB 5 file, by name; the variables that were not asked for are never opened."""

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

NUMERIC = frozenset(
    {"double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"}
)  # fmt: skip
VARIABLE_LIMIT = 4 * 2**30
"""bytes: scipy reads a variable whole, so one that claims more than this is refused before"""

_Result = TypeVar("_Result")


class MatFile:
    """The numeric variables of a MATLAB 5 file. Raises InputError; the caller puts the file's name before it."""

    def __init__(self, path: Path) -> None:
        from scipy.io import whosmat

        self._path = path
        self._kinds = {
            str(name): (tuple(int(n) for n in shape), str(kind))
            for name, shape, kind in _parsed(lambda: whosmat(path, appendmat=False))
        }

    @property
    def keys(self) -> frozenset[str]:
        """The names of the variables."""
        return frozenset(self._kinds)

    def shape(self, key: str) -> tuple[int, ...]:
        """What the file says the shape of a variable is. Raises InputError when it is missing."""
        if key not in self._kinds:
            found = ", ".join(repr(k) for k in sorted(self.keys)[:16]) or "nothing"
            raise InputError(f"{key} is missing; the file has {found}")
        return self._kinds[key][0]

    def array(self, key: str) -> FloatArray:
        """One variable as float64, with at least two axes, as MATLAB keeps it."""
        from scipy.io import loadmat

        shape = self.shape(key)
        kind = self._kinds[key][1]
        if kind not in NUMERIC:
            raise InputError(f"{key}: it is a MATLAB {kind} where real numbers are expected; save it as double")
        if any(n < 0 for n in shape) or math.prod(shape) * 8 > VARIABLE_LIMIT:
            raise InputError(f"{key}: it claims the shape {shape}, more than any recording needs; save the file again")
        value = _parsed(lambda: loadmat(self._path, appendmat=False, variable_names=[key])[key])
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise InputError(f"{key}: it holds {array.dtype} where real numbers are expected; save it as double")
        if array.shape != shape:
            raise InputError(f"{key}: its header claims shape {shape} but {array.shape} was found; save the file again")
        return array.astype(np.float64, copy=False)


def _parsed(parse: Callable[[], _Result]) -> _Result:
    """What scipy makes of the file; on damaged input it raises a dozen types, which become one here."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return parse()
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"the MATLAB file is damaged or truncated ({reason}); copy or save it again") from error
