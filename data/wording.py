"""Counts, shares, numbers and lengths in sentences: `1,009 frames`, `98.0 %`, `0.293 mm`."""

from collections.abc import Iterable
from math import isfinite, isinf

DASH = "–"
INFINITY = "∞"
MINUS = "\N{MINUS SIGN}"
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def plural(n: int, one: str, many: str = "") -> str:
    """The count, with commas, and its noun."""
    return f"{n:,} {noun(n, one, many)}"


def noun(n: int, one: str, many: str = "") -> str:
    """The noun alone: `one` for 1, else `many`, by default `one` with an s."""
    return one if n == 1 else many or f"{one}s"


def listed(items: Iterable[str]) -> str:
    """`a, b and c`."""
    every = list(items)
    return " and ".join([", ".join(every[:-1]), every[-1]] if len(every) > 1 else every)


def capitalized(text: str) -> str:
    """Text as a sentence begins: a symbol or name as first word, such as `uR` or `isam2`, keeps its letters."""
    first = text.partition(" ")[0]
    is_name = any(c.isupper() or c.isdigit() or c == "_" for c in first)
    return text if is_name else f"{text[:1].upper()}{text[1:]}"


def vector(values: Iterable[float], digits: int) -> str:
    """`(0.10, −0.20, 0.30)`."""
    return f"({', '.join(f'{value:.{digits}f}' for value in values)})".replace("-", MINUS)


def signed(value: float, digits: int) -> str:
    """`+0.36` or `−0.90`."""
    return f"{value:+.{digits}f}".replace("-", MINUS)


def number(value: object) -> str:
    """A number to three significant digits (whole from 1,000 on, counts in full), ∞, or a dash for None and NaN."""
    if isinstance(value, float) and isinf(value):
        return INFINITY if value > 0 else f"{MINUS}{INFINITY}"
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        return DASH
    if isinstance(value, int):
        return f"{value:,}".replace("-", MINUS)
    size = abs(value)
    if size == 0.0:
        return "0"
    if 1e-3 <= size < 999.5:
        return f"{value:#.3g}".rstrip(".").replace("-", MINUS)
    if 999.5 <= size < 1e6:
        return number(round(value))
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa} × 10{str(int(exponent)).translate(_SUPERSCRIPTS)}".replace("-", MINUS)


def per_cent(share: float) -> str:
    """A measured share of one in percent: `98.0 %`, `below 0.001 %` for a smaller one; a dash for NaN."""
    if 0.0 < abs(share) < 1e-5:
        return "below 0.001 %"
    return f"{number(100.0 * share)} %" if isfinite(share) else DASH


def limit_per_cent(share: float) -> str:
    """A limit or setting in percent, exact: `5 %`."""
    return f"{100.0 * share:g} %"


def distance(value: float) -> str:
    """A length in meters with its unit, in mm below 1 cm; `below 0.01 mm` for one that only rounding makes."""
    if abs(value) < 1e-5:
        return "below 0.01 mm"
    return f"{number(1e3 * value)} mm" if abs(value) < 0.01 else f"{number(value)} m"
