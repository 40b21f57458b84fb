"""How much of a time a set of poses, or of stretches between poses, covers."""

from collections.abc import Mapping

import numpy as np

from fgbaseline.geometry import FloatArray

LONG_GAP = 3.0
"""median intervals of a trajectory: two poses that are further apart have a gap between them"""

SMALLEST_SAMPLE = 30
"""poses or other items that a figure must be over to be judged"""
SMALLEST_COVERAGE = 0.5
"""share of the time that they must cover"""
FEWEST_STRETCHES = 3
"""of errors of motions over a stretch of the path: of fewer, no statistic says more than a single one"""


def covered(t: FloatArray, whole: FloatArray) -> float:
    """The share of the time of rising stamps `whole` (n,) in which there are rising stamps t (m,).

    The time between two stamps counts unless they are more than LONG_GAP of their median interval apart: gaps of
    `whole` are not asked for, and a slow t under a fast `whole` covers all of it.
    """
    time = _without_gaps(whole)
    return min(1.0, _without_gaps(t) / time) if time else 1.0


def spanned(start: FloatArray, end: FloatArray, whole: FloatArray) -> float:
    """The share of the time of rising stamps `whole` (n,) that stretches from `start` to `end` (m,) cover together."""
    time = _without_gaps(whole)
    if not time:
        return 1.0
    order = np.argsort(start)
    start, end = start[order], np.maximum.accumulate(end[order])
    before = np.concatenate([start[:1], end[:-1]])
    return min(1.0, float(np.maximum(end - np.maximum(start, before), 0.0).sum()) / time)


def too_small(sample: Mapping[str, float], smallest: int, coverage: float) -> bool:
    """Whether a sample has `n` below the smallest, or a `coverage`, where it has any, below that asked for, or

    `stretches`, where it has any, below FEWEST_STRETCHES.
    """
    few = sample.get("stretches", FEWEST_STRETCHES) < min(FEWEST_STRETCHES, smallest)
    return few or sample["n"] < smallest or sample.get("coverage", 1.0) < coverage


def _without_gaps(t: FloatArray) -> float:
    gaps = np.diff(t)
    return float(gaps[gaps <= LONG_GAP * np.median(gaps)].sum()) if len(gaps) else 0.0
