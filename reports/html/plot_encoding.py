"""Plots as a page has them: numbers packed as base64, the charts made of them, and the styles of lines."""

from base64 import b64encode
from collections.abc import Iterable, Mapping
from json import dumps
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray

from ..figures.panels import chi_square_limits
from ..figures.style import DASHES, on_dark

FINEST = 16
"""parts of a pixel that observations are rounded to, unless the image is too large for that"""


def floats(values: ArrayLike) -> str:
    """Single precision; NaN for what is not finite."""
    with np.errstate(over="ignore"):
        single = np.asarray(values, dtype=np.float64).astype("<f4")
    return _text(np.where(np.isfinite(single), single, np.float32(np.nan)))


def integers(values: ArrayLike, bits: int = 32) -> str:
    """Unsigned, of 8 or 32 bits."""
    return _text(np.asarray(values).astype(f"<u{bits // 8}"))


def flags(values: ArrayLike) -> str:
    """One bit each, the lowest first."""
    return _text(np.packbits(np.asarray(values, dtype=np.bool_), bitorder="little"))


def pixels(values: ArrayLike) -> tuple[str, int]:
    """Signed 16 bit integers, and how many of them make a pixel: a power of two, at most `FINEST`; 0 for NaN."""
    array = np.nan_to_num(np.asarray(values, dtype=np.float64))
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


TRUTH_LINE = "truth"
"""key of ground truth among the lines of a chart; those of estimators are numbers"""
OUTLIER = 10.0
"""factor by which one line is farther than every other, so that it alone flattens the others on a linear axis"""

Lines = dict[str, FloatArray]
Chart = dict[str, Any]
"""`group`, `name`, `title`, `unit`, `hint`, `log`, `smooth`, `band`, `middle`, `lines` by key and perhaps `bounds`"""


def grouped(charts: Mapping[str, Iterable[Chart | None]]) -> list[Chart]:
    """The charts of all groups, those without lines left out."""
    return [{"group": group, **one} for group, of in charts.items() for one in of if one is not None]


def chart(name: str, title: str, unit: str, lines: Lines, **more: Any) -> Chart | None:
    """A chart; None where no line has a value. `smooth` lines jump from frame to frame: they are shown as medians."""
    known = {key: values for key, values in lines.items() if np.isfinite(values).any()}
    if not known:
        return None
    look = {"log": _needs_log_scale(known.values()), "band": None, "middle": None, "smooth": False, "hint": ""}
    packed = {key: floats(values) for key, values in known.items()}
    return {"name": name, "title": title, "unit": unit, "lines": packed, **look, **more}


def _needs_log_scale(lines: Iterable[FloatArray]) -> bool:
    """Whether a logarithmic axis is needed to see more than one of lines that are nowhere negative."""
    series = [values[np.isfinite(values)] for values in lines]
    if any(values.min() < 0.0 for values in series):
        return False
    largest = sorted((float(values.max()) for values in series), reverse=True)
    return len(largest) > 1 and largest[0] > OUTLIER * largest[1] > 0.0


def expected(degrees: float, of: str, *, per: float = 1.0) -> dict[str, Any]:
    """Look of a chart of a consistent estimator's chi-square with so many degrees of freedom, over `per`."""
    low, median, high = chi_square_limits(degrees, per)
    hint = f"the band holds 95 % of the {of}; the dotted line is their median"
    return {"log": True, "band": (low, high), "middle": median, "hint": hint}


def numbered(names: Iterable[str], lines: Lines) -> Lines:
    """Lines by the number of their name among `names`, as text."""
    number = {name: str(i) for i, name in enumerate(names)}
    return {number[name]: np.asarray(values, dtype=np.float64) for name, values in lines.items()}


def position_covariances(view_R_body: FloatArray, covariance: FloatArray) -> FloatArray:
    """Position covariances (n, 6), m^2, xx, xy, xz, yy, yz, zz in the view, from pose ones (n, 6, 6) in body axes."""
    P = view_R_body @ covariance[:, :3, :3] @ np.swapaxes(view_R_body, 1, 2)
    row, column = np.triu_indices(3)
    return np.asarray(P[:, row, column])


def line_rules(colors: Mapping[str, str]) -> Markup:
    """`.estimator-KEY` sets `--estimator`, `--dash` and the `--sample` of a legend by the color of its line."""
    rules = "\n".join(f".estimator-{key} {{ {_line_style(color)} }}" for key, color in colors.items())
    dark = "\n".join(f".estimator-{key} {{ --estimator: {on_dark(color)}; }}" for key, color in colors.items())
    return Markup(f"{rules}\n@media screen and (prefers-color-scheme: dark) {{\n{dark}\n}}")


def _line_style(color: str) -> str:
    lengths = DASHES.get(color, ())
    if not lengths:
        return f"--estimator: {color}; --dash: none; --sample: linear-gradient(var(--estimator) 0 0);"
    ends = np.cumsum(lengths)
    stops = [
        f"{'transparent' if i % 2 else 'var(--estimator)'} {end - length:g}px {end:g}px"
        for i, (length, end) in enumerate(zip(lengths, ends.tolist(), strict=True))
    ]
    dash = " ".join(f"{length:g}" for length in lengths)
    return f"--estimator: {color}; --dash: {dash}; --sample: repeating-linear-gradient(90deg, {', '.join(stops)});"
