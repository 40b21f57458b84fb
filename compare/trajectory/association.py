"""Association of trajectories by time stamp: one-to-one pairs, interpolation, and stamps common to several."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from fgbaseline.data import Trajectory
from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import IntArray
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray, InputError, so3

from .alignment import Align, Alignment, align

TOLERANCE = 0.01
"""s, largest difference of paired stamps: a car at 15 m/s moves by 15 cm"""


class Association(StrEnum):
    """Rule by which poses are paired."""

    NEAREST = "nearest"
    """one to one: the closest two stamps first, never crossing in time"""
    INTERPOLATED = "interpolated"
    """the trajectory with the denser stamps is interpolated at those of the other, never beyond its ends"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class MatchedTrajectories(Displayed):
    """Paired poses of a reference and an estimate, n >= 1 of each, with the record of association and alignment.

    Input of every trajectory metric. `aligned` returns the same pairs with the estimate aligned to the reference.
    """

    reference: Trajectory
    """n poses"""
    estimate: Trajectory
    """n poses with `alignment` applied, at the stamps of the estimate plus `offset`"""
    association: Association
    tolerance: float
    """s"""
    offset: float
    """s, added to the estimate's stamps before they were compared"""
    left_out_reference: int
    """number of reference poses without a partner"""
    left_out_estimate: int
    interpolated: str = ""
    """name of the interpolated trajectory; empty if poses were paired by nearest stamps"""
    alignment: Alignment = field(default_factory=Alignment)
    """alignment applied to the estimate"""

    def __len__(self) -> int:
        return len(self.reference)

    @property
    def caption(self) -> str:
        """Association and alignment in one sentence, for a table's caption."""
        how = (
            "within" if self.association is Association.NEAREST else f"{self.interpolated} interpolated, stamps within"
        )
        shifted = f", {self.estimate.name} {self.offset:+.4g} s" if self.offset else ""
        left = f"left out: {self.left_out_reference:,} of the reference, {self.left_out_estimate:,} of the estimate"
        stamps = f"{how} {self.tolerance:.3g} s{shifted}" if self.reference.stamped else "by frame"
        return f"{plural(len(self), 'pose')} paired ({stamps}; {left}); {self.alignment.caption}"

    def aligned(
        self, kind: Align | str, *, first: int | None = None, up: FloatArray | tuple[float, ...] = (0.0, 0.0, 1.0)
    ) -> "MatchedTrajectories":
        """Pairs with the estimate aligned to the reference (see `align`); InputError where they are aligned already."""
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
) -> MatchedTrajectories:
    """Pair the poses of two trajectories by time, without alignment.

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
    return MatchedTrajectories(reference.at(i), moved.at(j), how, tolerance, offset, *left)


def nearest_pairs(a: FloatArray, b: FloatArray, tolerance: float) -> tuple[IntArray, IntArray]:
    """Pair rising stamps a and b, s: indices (n,) into each, closest first, one to one, never crossing in time.

    Each round pairs mutual nearest neighbors among the stamps left between the pairs so far. Of two equally near
    ones `a` takes the later and `b` the earlier, so that a shift of half an interval pairs neighbors.
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
    """Index of the nearest other stamp in the same slot, -1 where that is empty; ties go to the later or earlier."""
    if len(others) == 0:
        return np.full(len(stamps), -1)
    first, end = np.searchsorted(other_slot, slot, "left"), np.searchsorted(other_slot, slot, "right")
    here = np.searchsorted(others, stamps)
    after, before = np.clip(here, first, end - 1), np.clip(here - 1, first, end - 1)
    ahead, behind = np.abs(others[after] - stamps), np.abs(others[before] - stamps)
    nearer = np.where(ahead <= behind if later else ahead < behind, after, before)
    return np.asarray(np.where(first < end, nearer, -1), dtype=np.int64)


def _interpolated(
    reference: Trajectory, estimate: Trajectory, tolerance: float | None, offset: float
) -> MatchedTrajectories:
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
    return MatchedTrajectories(
        first, second, Association.INTERPOLATED, tolerance, offset, *left, interpolated=dense.name
    )


def _interval(path: Trajectory) -> float:
    return float(np.median(np.diff(path.t))) if len(path) > 1 else float("inf")


def _checked(tolerance: float) -> float:
    if not tolerance >= 0:
        raise InputError(f"tolerance: expected seconds of at least 0, got {tolerance!r}")
    return tolerance


def _require_some(n: int, reference: Trajectory, estimate: Trajectory, tolerance: float) -> None:
    if n == 0:
        for path, other in ((estimate, reference), (reference, estimate)):
            if _counts_frames(path) and not _counts_frames(other):
                first = f"({path.t[0]:g}, {path.t[1]:g}, ...)"
                raise InputError(
                    f"{path.source or path.name}: its first column counts frames {first} and has no times, while those "
                    f"of {other.name} begin at {float(other.t[0])!r} s; write the time of each pose in its place"
                )
        spans = [f"{p.name} runs from {float(p.t[0])!r} to {float(p.t[-1])!r} s" for p in (reference, estimate)]
        raise InputError(
            f"no pose of {estimate.source or estimate.name} is within {tolerance:.3g} s of one of "
            f"{reference.source or reference.name}: {' and '.join(spans)}; give a larger tolerance or an offset in time"
        )


def _counts_frames(path: Trajectory) -> bool:
    """Whether the stamps are 0, 1, 2, ... or 1, 2, 3, ...."""
    return len(path) > 2 and path.t[0] in (0.0, 1.0) and bool((np.diff(path.t) == 1.0).all())


def interpolated(path: Trajectory, t: FloatArray) -> Trajectory:
    """Trajectory at stamps t (n,), s, within its own: positions linear, rotations by SLERP (shortest way).

    At a stamp of the path the pose is reproduced exactly. Raises ValueError for stamps outside of the path.
    """
    if len(t) and (t[0] < path.t[0] or t[-1] > path.t[-1]):
        raise ValueError("a trajectory cannot be interpolated beyond its ends")
    after = np.clip(np.searchsorted(path.t, t, side="left"), 1, len(path) - 1)
    before = after - 1
    share = (t - path.t[before]) / (path.t[after] - path.t[before])
    poses = np.array(path.world_T_body[np.where(share == 1.0, after, before)])
    between = np.flatnonzero((share > 0.0) & (share < 1.0))
    a, b, s = before[between], after[between], share[between, None]
    turn = so3.log_so3(np.swapaxes(path.rotation[a], 1, 2) @ path.rotation[b])
    poses[between, :3, :3] = path.rotation[a] @ so3.exp_so3(s * turn)
    poses[between, :3, 3] = path.position[a] + s * (path.position[b] - path.position[a])
    return replace(path, t=t, world_T_body=poses, line=None)


RANKABLE_SHARE = 0.1
"""share of the longest estimate's stamps: an estimate with fewer is not ranked, since it would reduce the common
stamps of the others to its own"""


def rankable(counts: Mapping[str, int]) -> list[str]:
    """Names of the estimates with enough stamps to be ranked together, from the number of stamps of each."""
    most = max(counts.values(), default=0)
    return [name for name, n in counts.items() if n and n >= RANKABLE_SHARE * most]


def common_stamps(stamps: Mapping[str, FloatArray], tolerance: float) -> dict[str, IntArray]:
    """Indices (m,) by name into rising stamps (n,), s, that all estimates share, for rankings over the same stamps.

    Equal stamps; where fewer than two are equal, stamps within `tolerance` (s) of the shortest estimate's.
    """
    if not stamps:
        return {}
    exact = _common(stamps, 0.0)
    return exact if len(next(iter(exact.values()))) > 1 else _common(stamps, tolerance)


def _common(stamps: Mapping[str, FloatArray], tolerance: float) -> dict[str, IntArray]:
    base = min(stamps.values(), key=len)
    pairs = {name: nearest_pairs(base, t, tolerance) for name, t in stamps.items()}
    kept = np.arange(len(base))
    for i, _ in pairs.values():
        kept = np.intersect1d(kept, i, assume_unique=True)
    return {name: np.asarray(j[np.searchsorted(i, kept)], dtype=np.int64) for name, (i, j) in pairs.items()}
