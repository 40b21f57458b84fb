"""Coverage: share of a time span covered by poses or intervals, and the smallest sample for a verdict."""

from collections.abc import Mapping

import numpy as np

from fgbaseline.geometry import FloatArray

GAP = 3.0
"""median intervals between stamps: a longer interval is a gap"""

MIN_SAMPLE_SIZE = 30
"""poses or other items below which a value is not judged"""
MIN_COVERAGE = 0.5
"""share of the time span below which a value is not judged"""
MIN_STRETCHES = 3
"""disjoint stretches of the path below which relative errors are not judged"""


def time_coverage(t: FloatArray, whole: FloatArray) -> float:
    """Share of the time of rising stamps `whole` (n,), s, that rising stamps t (m,), s, cover.

    The time between two stamps counts unless it exceeds GAP median intervals. Gaps of `whole` are excluded, and a slow
    t under a fast `whole` covers all of it.
    """
    time = _without_gaps(whole)
    return min(1.0, _without_gaps(t) / time) if time else 1.0


def interval_coverage(start: FloatArray, end: FloatArray, whole: FloatArray) -> float:
    """Share of the time of rising stamps `whole` (n,), s, in the union of intervals `start` to `end` (m,), s."""
    time = _without_gaps(whole)
    if not time:
        return 1.0
    order = np.argsort(start)
    start, end = start[order], np.maximum.accumulate(end[order])
    before = np.concatenate([start[:1], end[:-1]])
    return min(1.0, float(np.maximum(end - np.maximum(start, before), 0.0).sum()) / time)


def is_insufficient(sample: Mapping[str, float], smallest: int, coverage: float) -> bool:
    """Whether a sample is too small: `n` below `smallest`, `coverage` too low or fewer than MIN_STRETCHES `stretches`.

    `coverage` and `stretches` are tested only if the sample has them.
    """
    few = sample.get("stretches", MIN_STRETCHES) < min(MIN_STRETCHES, smallest)
    return few or sample["n"] < smallest or sample.get("coverage", 1.0) < coverage


def _without_gaps(t: FloatArray) -> float:
    gaps = np.diff(t)
    return float(gaps[gaps <= GAP * np.median(gaps)].sum()) if len(gaps) else 0.0
