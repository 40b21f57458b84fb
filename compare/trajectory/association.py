"""Which pose of an estimate belongs to which of the reference: by time, each at most once, and what is left over."""

from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from fgbaseline.data import Trajectory
from fgbaseline.data.observations import IntArray
from fgbaseline.data.plural import plural
from fgbaseline.geometry import FloatArray, InputError

from .alignment import Align, Alignment, align
from .interpolation import interpolated

TOLERANCE = 0.01
"""s; at 15 m/s a car has moved by 15 cm"""


class Association(StrEnum):
    """How poses are paired."""

    NEAREST = "nearest"
    """one to one: the closest two stamps first, never crossing in time"""
    INTERPOLATED = "interpolated"
    """the trajectory with the denser stamps is interpolated at those of the other, never beyond its ends"""


@dataclass(frozen=True, eq=False, slots=True)
class Matched:
    """n >= 1 poses of a reference and n of an estimate for the same moments, and how they came to be paired.

    What every metric takes. `aligned` gives the same with the estimate laid over the reference.
    """

    reference: Trajectory
    """n poses"""
    estimate: Trajectory
    """n poses, `alignment` applied; its stamps are its own, `offset` included"""
    association: Association
    tolerance: float
    """s"""
    offset: float
    """s, added to the estimate's stamps before they were compared"""
    left_out_reference: int
    """how many of the reference's poses have no partner"""
    left_out_estimate: int
    interpolated: str = ""
    """the name of the trajectory that was interpolated, if one was"""
    alignment: Alignment = field(default_factory=Alignment)
    """what was done to the estimate"""

    def __len__(self) -> int:
        return len(self.reference)

    @property
    def caption(self) -> str:
        """What was paired and how it was aligned, in a sentence for under a table."""
        how = (
            "within" if self.association is Association.NEAREST else f"{self.interpolated} interpolated, stamps within"
        )
        shifted = f", {self.estimate.name} {self.offset:+.4g} s" if self.offset else ""
        left = f"left out: {self.left_out_reference} of the reference, {self.left_out_estimate} of the estimate"
        stamps = f"{how} {self.tolerance:.3g} s{shifted}" if self.reference.stamped else "by frame"
        return f"{plural(len(self), 'pose')} paired ({stamps}; {left}); {self.alignment.caption}"

    def aligned(
        self, kind: Align | str, *, first: int | None = None, up: FloatArray | tuple[float, ...] = (0.0, 0.0, 1.0)
    ) -> "Matched":
        """The same pairs with the estimate laid over the reference: see `align`. Anew, not on top of what was done."""
        if self.alignment.kind is not Align.NONE:
            raise InputError(f"{self.estimate.name}: it is aligned already ({self.alignment.caption}); align it once")
        done = align(self.estimate.world_T_body, self.reference.world_T_body, kind, first=first, up=up)
        moved = replace(self.estimate, world_T_body=done.apply(self.estimate.world_T_body), proven=True)
        return replace(self, estimate=moved, alignment=done)


def associate(
    reference: Trajectory,
    estimate: Trajectory,
    *,
    how: Association | str = Association.NEAREST,
    tolerance: float | None = None,
    offset: float = 0.0,
) -> Matched:
    """Pairs the poses of two trajectories by time, not aligned.

    `offset` (s) is added to the estimate's stamps. `tolerance` (s) is the largest difference to the nearest stamp:
    by default TOLERANCE for `nearest`, the median interval of the interpolated trajectory for `interpolated`. Of two
    equally dense trajectories the reference is interpolated. Raises InputError where no pose has a partner, or one
    trajectory has time stamps and the other only frame numbers.
    """
    how = Association(how)
    if reference.stamped != estimate.stamped:
        bare, timed = (estimate, reference) if reference.stamped else (reference, estimate)
        raise InputError(
            f"{bare.source or bare.name}: it has no time stamps, but {timed.source or timed.name} has; "
            "give it the times of its frames"
        )
    moved = estimate.later(offset) if offset else estimate
    if how is Association.INTERPOLATED:
        return _interpolated(reference, moved, tolerance, offset)
    tolerance = _checked(TOLERANCE if tolerance is None else tolerance)
    i, j = nearest_pairs(reference.t, moved.t, tolerance)
    _require_some(len(i), reference, moved, tolerance)
    left = (len(reference) - len(i), len(moved) - len(j))
    return Matched(reference.at(i), moved.at(j), how, tolerance, offset, *left)


def nearest_pairs(a: FloatArray, b: FloatArray, tolerance: float) -> tuple[IntArray, IntArray]:
    """Indices (n,) into rising stamps a and b, both rising: the closest two first, each once, none crossing in time.

    Each round pairs those that are nearest to each other among what is left between the pairs so far; of two equally
    near ones that is the later for `a` and the earlier for `b`, so that a shift of half an interval pairs neighbours.
    """
    left_a, left_b = np.arange(len(a)), np.arange(len(b))
    paired_a, paired_b = np.empty(0, np.int64), np.empty(0, np.int64)
    while True:
        slot_a, slot_b = np.searchsorted(paired_a, left_a), np.searchsorted(paired_b, left_b)
        to_b = _nearest(a[left_a], slot_a, b[left_b], slot_b, later=True)
        to_a = _nearest(b[left_b], slot_b, a[left_a], slot_a, later=False)
        mutual = np.flatnonzero((to_b >= 0) & (to_a[to_b] == np.arange(len(left_a))) if len(left_b) else [])
        if len(mutual) == 0:
            return paired_a, paired_b
        i, j = left_a[mutual], left_b[to_b[mutual]]
        close = np.abs(a[i] - b[j]) <= tolerance
        paired_a = np.sort(np.concatenate([paired_a, i[close]]))
        paired_b = np.sort(np.concatenate([paired_b, j[close]]))
        left_a, left_b = np.setdiff1d(left_a, i, True), np.setdiff1d(left_b, j, True)


def _nearest(stamps: FloatArray, slot: IntArray, others: FloatArray, other_slot: IntArray, later: bool) -> IntArray:
    """For each stamp the index of the nearest other of the same slot, -1 where that is empty; of two equally near
    ones the later or the earlier."""
    if len(others) == 0:
        return np.full(len(stamps), -1)
    first, end = np.searchsorted(other_slot, slot, "left"), np.searchsorted(other_slot, slot, "right")
    here = np.searchsorted(others, stamps)
    after, before = np.clip(here, first, end - 1), np.clip(here - 1, first, end - 1)
    ahead, behind = np.abs(others[after] - stamps), np.abs(others[before] - stamps)
    nearer = np.where(ahead <= behind if later else ahead < behind, after, before)
    return np.asarray(np.where(first < end, nearer, -1), dtype=np.int64)


def _interpolated(reference: Trajectory, estimate: Trajectory, tolerance: float | None, offset: float) -> Matched:
    coarse, dense = (estimate, reference) if _interval(reference) <= _interval(estimate) else (reference, estimate)
    if len(dense) < 2:
        raise InputError(f"{dense.source or dense.name}: it has one pose only, which cannot be interpolated")
    tolerance = _checked(_interval(dense) if tolerance is None else tolerance)
    inside = (coarse.t >= dense.t[0]) & (coarse.t <= dense.t[-1])
    after = np.clip(np.searchsorted(dense.t, coarse.t), 1, len(dense) - 1)
    gap = np.minimum(np.abs(dense.t[after] - coarse.t), np.abs(dense.t[after - 1] - coarse.t))
    chosen = np.flatnonzero(inside & (gap <= tolerance))
    _require_some(len(chosen), reference, estimate, tolerance)
    kept, drawn = coarse.at(chosen), interpolated(dense, coarse.t[chosen])
    first, second = (drawn, kept) if dense is reference else (kept, drawn)
    unused = int(((dense.t < kept.t[0]) | (dense.t > kept.t[-1])).sum())
    left = (unused, len(coarse) - len(kept)) if dense is reference else (len(coarse) - len(kept), unused)
    return Matched(first, second, Association.INTERPOLATED, tolerance, offset, *left, interpolated=dense.name)


def _interval(path: Trajectory) -> float:
    return float(np.median(np.diff(path.t))) if len(path) > 1 else float("inf")


def _checked(tolerance: float) -> float:
    if not tolerance >= 0:
        raise InputError(f"tolerance: expected seconds of at least 0, got {tolerance!r}")
    return tolerance


def _require_some(n: int, reference: Trajectory, estimate: Trajectory, tolerance: float) -> None:
    if n == 0:
        spans = [f"{p.name} runs from {float(p.t[0])!r} to {float(p.t[-1])!r} s" for p in (reference, estimate)]
        raise InputError(
            f"no pose of {estimate.source or estimate.name} is within {tolerance:.3g} s of one of "
            f"{reference.source or reference.name}: {' and '.join(spans)}; give a larger tolerance or an offset in time"
        )
