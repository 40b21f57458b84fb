"""Lists, vectors and ranges of frames formatted for sentences."""

from collections.abc import Iterable
from itertools import pairwise

from fgbaseline.data.finding import Finding
from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray

__all__ = ["Finding", "listed", "spans", "vector"]


def listed(words: Iterable[str]) -> str:
    """'a, b and c'."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def vector(values: FloatArray, digits: int) -> str:
    """'(0.10, -0.20, 0.30)'."""
    return f"({', '.join(f'{value:.{digits}f}' for value in values)})"


def spans(frames: IntArray, most: int = 4) -> str:
    """Runs of increasing indices, the longest first so many: '121-127, 150 and 3 more'; those 2 apart are one run."""
    if len(frames) == 0:
        return "none"
    cuts = [0, *(i + 1 for i in range(len(frames) - 1) if frames[i + 1] - frames[i] > 2), len(frames)]
    runs = [(int(frames[a]), int(frames[b - 1])) for a, b in pairwise(cuts)]
    shown = sorted(sorted(runs, key=lambda run: run[0] - run[1])[:most])
    text = ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in shown)
    return text + (f" and {len(runs) - most} more" if len(runs) > most else "")
