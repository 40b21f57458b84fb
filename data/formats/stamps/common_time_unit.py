"""Units of two sets of time stamps, by the time span that they share."""

from collections.abc import Mapping
from itertools import product

from ...time_unit import TimeUnit

Spans = Mapping[TimeUnit, tuple[float, float]]
"""possible unit -> first and last stamp, s"""
CLEARLY = 10.0
"""ratio of the common time in one unit to that in the next best, above which the unit is decided"""


def units_in_common(first: Spans, second: Spans) -> tuple[TimeUnit, TimeUnit] | None:
    """Units by which two sets of stamps share the most time, relative to the time that either covers.

    None if other units are not clearly worse (CLEARLY).
    """
    choices = list(product(first, second))
    if len(choices) == 1:
        return choices[0]
    shares = sorted(((_shared(first[a], second[b]), (a, b)) for a, b in choices), reverse=True)
    (best, chosen), (next_best, _) = shares[0], shares[1]
    return chosen if best > 0.0 and best >= CLEARLY * next_best else None


def _shared(a: tuple[float, float], b: tuple[float, float]) -> float:
    common = min(a[1], b[1]) - max(a[0], b[0])
    union = max(a[1], b[1]) - min(a[0], b[0])
    return common / union if common > 0.0 and union > 0.0 else 0.0
