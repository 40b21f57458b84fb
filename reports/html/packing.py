"""Arrays inside the page: little-endian bytes as base64, which a browser reads into a typed array as they are."""

from base64 import b64encode
from json import dumps
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike

FINEST = 16
"""parts of a pixel that observations are rounded to, unless the image is too large for that"""


def floats(values: ArrayLike) -> str:
    """Single precision; NaN for what is not finite."""
    array = np.asarray(values, dtype=np.float64)
    with np.errstate(over="ignore"):
        single = np.where(np.isfinite(array), array, np.nan).astype("<f4")
    return _text(np.where(np.isfinite(single), single, np.nan).astype("<f4"))


def integers(values: ArrayLike) -> str:
    """Unsigned, 32 bits."""
    return _text(np.asarray(values).astype("<u4"))


def small_integers(values: ArrayLike) -> str:
    """Unsigned, 8 bits."""
    return _text(np.asarray(values).astype("u1"))


def flags(values: ArrayLike) -> str:
    """One bit each, the lowest first."""
    return _text(np.packbits(np.asarray(values, dtype=np.bool_), bitorder="little"))


def pixels(values: ArrayLike) -> tuple[str, int]:
    """Signed 16 bit integers, and how many of them make a pixel: a power of two, at most `FINEST`."""
    array = np.asarray(values, dtype=np.float64)
    largest = float(np.abs(array).max()) if array.size else 0.0
    parts = FINEST
    while parts > 1 and largest * parts > 32000.0:
        parts //= 2
    return _text(np.clip(np.rint(array * parts), -32768, 32767).astype("<i2")), parts


def embedded_json(value: Any) -> Markup:
    """JSON that cannot end the element it stands in, whatever its texts are."""
    text = dumps(value, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return Markup(text)  # nosec: no markup can be left in it


def _text(array: np.ndarray) -> str:
    return b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
