"""Numbers, counts and names as text: for sentences and tables, and made safe for LaTeX and Markdown."""

import re
from collections.abc import Hashable, Iterable, Mapping
from math import isfinite
from typing import TypeVar

from fgbaseline.data.finding import MEASURES
from fgbaseline.data.wording import DASH, INFINITY, MINUS, distance, limit_per_cent, listed, number, per_cent, plural

__all__ = ["DASH", "INFINITY", "MINUS", "distance", "limit_per_cent", "listed", "number", "per_cent"]
NO_BREAK = "\N{NO-BREAK SPACE}"
RESOLUTION = 1e-5
"""m and degrees, below which estimates of a run do not differ: `isam2` does not propagate smaller changes"""
SMALLEST: Mapping[str, float] = {"m": RESOLUTION, "°": RESOLUTION, "%": 10.0 * RESOLUTION, "°/m": 0.1 * RESOLUTION}
"""by unit, what means something in a comparison of trajectories; rates are over 10 m of the path"""
_TOGETHER = re.compile(
    r"(?<=[\d⁰¹²³⁴-⁹]) (?=[%°]|(?:m|km|mm|px|s|ms|m/s|rad/s)\b)|(?<=\d) (?=× 10)|(?<=×) (?=10)|(?<=,) (?=[^\[\]]*\])"
)
"""spaces within a quantity and within an interval"""
_DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_TEX = {
    "\\": r"\textbackslash{}",
    **{c: "\\" + c for c in "&%$#_{}"},
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "°": r"$^\circ$",
    "×": r"$\times$",
    "↑": r"$\uparrow$",
    "↓": r"$\downarrow$",
    "–": "--",
    MINUS: "$-$",
}
counted = plural
"""a count and its noun"""
Key = TypeVar("Key", bound=Hashable)
Item = TypeVar("Item")


def grouped(pairs: Iterable[tuple[Key, Item]]) -> dict[Key, list[Item]]:
    """The items of each key, in the order of the pairs."""
    groups: dict[Key, list[Item]] = {}
    for key, item in pairs:
        groups.setdefault(key, []).append(item)
    return groups


def interval(value: float, low: float, high: float) -> str:
    """`0.52 [0.41, 0.66]`, or the value alone where its interval is not finite."""
    return f"{number(value)} [{number(low)}, {number(high)}]" if isfinite(low) and isfinite(high) else number(value)


def resolution(of_files: Mapping[str, float], unit: str) -> float:
    """Size below which a value of a comparison is rounding: that of its files, at least `SMALLEST`, or 0."""
    return max(of_files.get(unit, 0.0), SMALLEST.get(unit, 0.0))


def resolved(value: float, resolution: float) -> str:
    """A number, or `< 1 × 10⁻⁵` for one below the resolution of what it comes from (`> −1 × 10⁻⁵` if negative)."""
    if abs(value) >= resolution or value != value:
        return number(value)
    bound = number(resolution).replace(".00 ", " ")
    return f"> {MINUS}{bound}" if value < 0.0 else f"< {bound}"


def meters(value: float) -> str:
    """`0.35 m`, `79.6 m`, `1,342 m`, `28.9 km`; `no trajectory` for what is not finite."""
    if not isfinite(value):
        return "no trajectory"
    size = abs(value)
    if size >= 9_999.5:
        return f"{value / 1000:.3g} km"
    return f"{value:,.0f} m" if size >= 999.5 else f"{value:.3g} m"


def pixels(value: float) -> str:
    """`30.6 px`, or `no trajectory` for what is not finite."""
    return f"{value:.3g} px" if isfinite(value) else "no trajectory"


def quantity(value: float, unit: str) -> str:
    """A finding's value: a share in percent, a physical unit beside the number, and none beside a count."""
    if unit.startswith("share"):
        return per_cent(value)
    if unit in MEASURES:
        return f"{number(value)}{'' if unit == '°' else NO_BREAK}{unit}"
    return number(int(value) if float(value).is_integer() else value)


def unbroken(text: str) -> str:
    """A sentence whose quantities and intervals stay on one line."""
    return _TOGETHER.sub(NO_BREAK, text)


def tex(text: str) -> str:
    """Text from files, escaped for LaTeX."""
    escaped = "".join(_TEX.get(c, c) for c in text)
    return re.sub("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda found: f"$^{{{found[0].translate(_DIGITS)}}}$", escaped)


def md(text: str) -> str:
    """Text from files on one line, escaped for Markdown."""
    return re.sub(r"([\\`*_{}\[\]<>#|~@])", r"\\\1", " ".join(text.split()))
