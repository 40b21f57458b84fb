"""Whether a figure keeps within what was promised for it."""

import math
from dataclasses import dataclass
from enum import StrEnum

EXACT = 12
"""significant digits of a sum of two figures: 0.7 + 0.1 is 0.8, and not a little less"""


class Outcome(StrEnum):
    """What a limit comes to, worst last in what it says of the figure."""

    HOLDS = "holds"
    CANNOT_TELL = "cannot tell"
    """there is no figure (NaN), or nothing that it can be held against"""
    FALLS_SHORT = "falls short"


class Better(StrEnum):
    """Which way a figure may leave its baseline as far as it likes."""

    LOWER = "lower"
    HIGHER = "higher"
    NEITHER = "neither"
    """any change beyond the tolerance is one for the worse"""


@dataclass(frozen=True, slots=True)
class Bounds:
    """A closed interval, in the unit of the figure; infinite where it is open."""

    at_least: float = -math.inf
    at_most: float = math.inf

    def margin(self, value: float) -> float:
        """How far inside the nearer bound a finite value is, in its unit; negative outside."""
        return min(value - self.at_least, self.at_most - value)

    def judge(self, value: float | None) -> Outcome:
        """HOLDS for a finite value within, bounds included; an infinite one never does, of NaN nothing is known."""
        if value is None or math.isnan(value):
            return Outcome.CANNOT_TELL
        held = math.isfinite(value) and self.at_least <= value <= self.at_most
        return Outcome.HOLDS if held else Outcome.FALLS_SHORT


def around(baseline: float, better: Better, *, relative: float = 0.0, absolute: float = 0.0) -> Bounds:
    """The bounds that a baseline sets: it may be worse by `absolute` or by `relative * |baseline|`, the larger one."""
    allowed = max(absolute, relative * abs(baseline))
    return Bounds(
        at_least=-math.inf if better is Better.LOWER else rounded(baseline - allowed, EXACT),
        at_most=math.inf if better is Better.HIGHER else rounded(baseline + allowed, EXACT),
    )


def rounded(value: float, digits: int) -> float:
    """A finite value to so many significant digits."""
    return float(f"{value:.{digits - 1}e}")
