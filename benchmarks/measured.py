"""A row of docs/performance.md: what is claimed, what was wanted, what was measured."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """One claim, measured."""

    claim: str
    wanted: str
    ratio_or_value: str
    """the median over the runs"""
    spread: str
    """min to max over the runs"""
    met: bool | None
    """None where nothing was asked for, or nothing could be measured"""


def table(rows: Iterable[Row]) -> str:
    """The rows in Markdown."""
    said = {True: "yes", False: "**no**", None: ""}
    lines = ["| what | wanted | median | min to max | met |", "|---|---|---|---|---|"]
    lines += [f"| {r.claim} | {r.wanted} | {r.ratio_or_value} | {r.spread} | {said[r.met]} |" for r in rows]
    return "\n".join(lines)
