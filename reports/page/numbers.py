"""Numbers as a person reads them: three significant digits, a dash for what is not one, ∞ for an infinite one."""

from collections.abc import Iterable
from math import isfinite, isinf

from fgbaseline.data.plural import noun

DASH = "–"
INFINITY = "∞"
NO_BREAK = "\N{NO-BREAK SPACE}"


def number(value: object) -> str:
    """A number to three significant digits (whole from 1000 on, counts in full), ∞, or a dash for None and NaN."""
    if isinstance(value, float) and isinf(value):
        return INFINITY if value > 0 else f"\N{MINUS SIGN}{INFINITY}"
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        return DASH
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
    size = abs(value)
    if size == 0.0:
        return "0"
    if 1e-3 <= size < 999.5:
        return f"{value:#.3g}".rstrip(".").replace("-", "\N{MINUS SIGN}")
    if 999.5 <= size < 1e6:
        return number(round(value)).replace("-", "\N{MINUS SIGN}")
    mantissa, exponent = f"{value:.2e}".split("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa} × 10{raised}".replace("-", "\N{MINUS SIGN}")


def counted(n: int, one: str, many: str = "") -> str:
    """A count and its noun: `one` for 1, else `many`, by default `one` with an s."""
    return f"{number(n)} {noun(n, one, many)}"


def per_cent(share: float) -> str:
    """A share of one as per cent."""
    return f"{100.0 * share:.3g} %"


def quantity(value: float, unit: str) -> str:
    """A finding's figure: a share as per cent, a physical unit beside the number, and none beside what is counted."""
    if unit.startswith("share"):
        return per_cent(value)
    if unit in ("m/s", "rad/s", "°"):
        return f"{number(value)}{'' if unit == '°' else NO_BREAK}{unit}"
    return number(int(value) if float(value).is_integer() else value)


def listed(items: Iterable[str]) -> str:
    """`a, b and c`."""
    every = list(items)
    return " and ".join([", ".join(every[:-1]), every[-1]] if len(every) > 1 else every)
