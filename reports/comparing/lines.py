"""One colour and one line for a trajectory in every figure of a comparison."""

from typing import Any

from ..figures.lettering import plain
from ..figures.palette import colours_of
from ..trajectories.comparison import Comparison


def colours(comparison: Comparison) -> dict[str, str]:
    """By name; the reference is black."""
    return colours_of([comparison.reference.name, *comparison.results], comparison.reference.name)


def line(comparison: Comparison, name: str) -> dict[str, Any]:
    """How a trajectory's line is drawn: the reference lies below the others, and shows beside them."""
    is_reference = name == comparison.reference.name
    return {
        "color": colours(comparison)[name],
        "linewidth": 2.6 if is_reference else 1.3,
        "zorder": 2.0 if is_reference else 2.5,
        "label": plain(name) + (" (reference)" if is_reference else ""),
    }
