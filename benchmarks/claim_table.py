"""Claims of a benchmark with their measured values, and their table."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray


@dataclass(frozen=True, slots=True)
class Row:
    """A claim and what was measured of it."""

    claim: str
    wanted: str
    ratio_or_value: str
    """the median over the runs"""
    spread: str
    """the least to the largest over the runs"""
    met: bool | None
    """None where nothing is asked for, or nothing could be measured"""


def row(
    claim: str,
    values: Sequence[float] | FloatArray,
    unit: str,
    *,
    least: float | None = None,
    most: float | None = None,
) -> Row:
    """Claim on the median of values over runs: at least or at most a bound."""
    middle = float(np.median(values))
    met = (
        None
        if least is None and most is None
        else (least is None or middle >= least) and (most is None or middle <= most)
    )
    asked = [f"{word} {bound:g}{unit}" for word, bound in (("at least", least), ("at most", most)) if bound is not None]
    spread = f"{_figure(min(values))} to {_figure(max(values))}"
    return Row(claim, ", ".join(asked), f"{_figure(middle)}{unit}", spread, met)


def table(rows: Iterable[Row]) -> str:
    """The rows as Markdown."""
    said = {True: "yes", False: "**no**", None: ""}
    lines = ["| claim | wanted | median | least to largest | met |", "|---|---|---|---|---|"]
    lines += [f"| {r.claim} | {r.wanted} | {r.ratio_or_value} | {r.spread} | {said[r.met]} |" for r in rows]
    return "\n".join(lines)


def _figure(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
