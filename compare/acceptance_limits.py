"""Acceptance limits of a metric: bounds, absolute or around a baseline, and their outcome."""

import math
from dataclasses import dataclass
from enum import StrEnum

EXACT = 12
"""significant digits of a bound, so that 0.7 + 0.1 is 0.8 and not 0.7999999999999999"""


class Outcome(StrEnum):
    """Outcome of a limit."""

    HOLDS = "holds"
    UNDECIDED = "undecided"
    """no value (NaN), or no bounds to compare it with"""
    VIOLATED = "violated"


class Better(StrEnum):
    """Direction in which a metric improves, and in which it may differ from its baseline without limit."""

    LOWER = "lower"
    HIGHER = "higher"
    NEITHER = "neither"
    """any change beyond the tolerance is a regression"""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Closed interval in the unit of the metric; infinite bounds leave it open."""

    at_least: float = -math.inf
    at_most: float = math.inf

    def margin(self, value: float) -> float:
        """Distance of a finite value to the nearer bound, in its unit; negative outside."""
        return min(value - self.at_least, self.at_most - value)

    def judge(self, value: float | None) -> Outcome:
        """HOLDS for a finite value inside or on the bounds, UNDECIDED for None and NaN, VIOLATED otherwise."""
        if value is None or math.isnan(value):
            return Outcome.UNDECIDED
        held = math.isfinite(value) and self.at_least <= value <= self.at_most
        return Outcome.HOLDS if held else Outcome.VIOLATED


def around(baseline: float, better: Better, *, relative: float = 0.0, absolute: float = 0.0) -> Bounds:
    """Bounds around an accuracy baseline: a value may be worse by `absolute` or `relative * |baseline|`, the larger."""
    allowed = max(absolute, relative * abs(baseline))
    return Bounds(
        at_least=-math.inf if better is Better.LOWER else rounded(baseline - allowed, EXACT),
        at_most=math.inf if better is Better.HIGHER else rounded(baseline + allowed, EXACT),
    )


def rounded(value: float, digits: int) -> float:
    """Finite value rounded to significant digits."""
    return float(f"{value:.{digits - 1}e}")
