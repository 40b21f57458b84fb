"""Feature tracks: a detector replaces points that the tracker loses.

A point is detected at a frame and tracked until the tracker loses it, it leaves the images or comes too near. A share
of the points is found again. Track lengths are log-normal, as in the real recordings.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray

from ..observations import BoolArray, IntArray
from .camera_view import CameraView

SHORTEST = 3
"""frames; shorter tracks are not kept, as in the course's files"""
_SPREAD = 0.95
"""standard deviation of the logarithm of a lifetime"""
_OFFERED = 8.0
"""candidates for each point that is wanted, where all are new"""
_CHUNK = 20_000

Source = Callable[[IntArray, np.random.Generator], tuple[FloatArray, FloatArray]]
"""birth frames (n,) -> where points are at birth (n, 3), m, and how they move (n, 3), m/s"""


@dataclass(frozen=True, eq=False, slots=True)
class Tracks:
    """m tracks with n observations, sorted by track, then frame."""

    frame: IntArray
    """(n,)"""
    track: IntArray
    """(n,) 0..m-1, in the order in which tracks begin"""
    point: FloatArray
    """(n, 3) where the point is at that frame, m, in the world"""
    first: FloatArray
    """(m, 3) where it was when the track began"""


@dataclass(frozen=True, slots=True)
class Tracking:
    """Settings of the tracker."""

    features: float
    """points a frame, on average"""
    length: float
    """median number of frames a point is held"""
    farthest: float
    """m, where a track can begin"""
    returning: float = 0.0
    """share of the tracks that are lost and found again"""
    return_after: int = 0
    """frames from first sight to the return"""


@dataclass(frozen=True, eq=False, slots=True)
class _Candidates:
    """c points that could be tracked, in the order of their birth frames."""

    birth: IntArray
    """(c,) the frame at which a point is found"""
    start: FloatArray
    """(c, 3) where it is then, m"""
    velocity: FloatArray
    """(c, 3) m/s"""

    def __len__(self) -> int:
        return len(self.birth)

    def select(self, chosen: BoolArray | IntArray) -> "_Candidates":
        return _Candidates(self.birth[chosen], self.start[chosen], self.velocity[chosen])

    def at(self, row: IntArray, frame: IntArray, t: FloatArray) -> FloatArray:
        """Positions (n, 3), m, of the points in rows (n,) at frames (n,)."""
        if not self.velocity.any():
            return self.start[row]
        return self.start[row] + self.velocity[row] * (t[frame] - t[self.birth[row]])[:, None]


def follow(
    source: Source,
    sight: CameraView,
    t: FloatArray,
    how: Tracking,
    rng: np.random.Generator,
    returns: np.random.Generator,
) -> Tracks:
    """Tracks over the frames at times `t` (T,) s of points that `source` offers.

    `rng` draws points and lifetimes, `returns` which tracks are found again.
    """
    wanted = _wanted(how.features, sight.seeing, t, rng)
    candidates = _born(source, sight, how, wanted, rng)
    length = _held(candidates, candidates.birth, _lifetimes(len(candidates), how, rng), sight, t)
    kept = np.flatnonzero(length >= min(SHORTEST, len(t)))
    chosen = kept[_top_up(candidates.birth[kept], length[kept], wanted)]
    tracked = candidates.select(chosen)
    track, frame = _expand(tracked.birth, length[chosen])

    back = np.flatnonzero(returns.random(len(tracked)) < how.returning)
    if len(back):
        lost = tracked.birth[back] + length[chosen][back]
        again = np.maximum(lost + 1, tracked.birth[back] + how.return_after)
        second = _held(tracked.select(back), again, _lifetimes(len(back), how, returns), sight, t)
        row, later = _expand(again, second)
        track, frame = np.concatenate([track, back[row]]), np.concatenate([frame, later])
        order = np.lexsort((frame, track))
        track, frame = track[order], frame[order]
    return Tracks(frame, track, tracked.at(track, frame, t), tracked.start)


def _lifetimes(n: int, how: Tracking, rng: np.random.Generator) -> IntArray:
    """Numbers (n,) of frames for which a tracker holds a point that stays in view."""
    return np.maximum(rng.lognormal(np.log(how.length), _SPREAD, n), SHORTEST).astype(np.int64)


def _wanted(features: float, seeing: BoolArray, t: FloatArray, rng: np.random.Generator) -> IntArray:
    """Numbers (T,) of points that the detector asks for: they vary by a quarter over seconds, as texture does."""
    n = len(t)
    place = (t - t[0]) / 4.0
    around = [np.floor(place), np.floor(place) + 1.0, np.ceil(place[-1:]) + 1.0]
    knots = 4.0 * np.unique(np.concatenate(around))  # those next to a frame, however far apart frames are
    swing = np.interp(t - t[0], knots, rng.standard_normal(len(knots)))
    level = np.exp(0.27 * swing)
    level *= features / level.mean()
    return np.where(seeing, np.floor(level + rng.random(n)), 0).astype(np.int64)


def _born(source: Source, sight: CameraView, how: Tracking, wanted: IntArray, rng: np.random.Generator) -> _Candidates:
    """More candidates than are wanted, all of them seen at birth; many where the detector starts anew."""
    anew = sight.seeing & ~np.concatenate([[False], sight.seeing[:-1]])
    offered = np.ceil(wanted * np.where(anew, _OFFERED, np.minimum(_OFFERED, 12.0 / how.length))) + 12 * (wanted > 0)
    birth = np.repeat(np.arange(len(wanted)), offered.astype(np.int64))
    start, velocity = source(birth, rng)
    return _Candidates(birth, start, velocity).select(sight.visible(birth, start, how.farthest))


def _held(candidates: _Candidates, begin: IntArray, life: IntArray, sight: CameraView, t: FloatArray) -> IntArray:
    """Numbers (c,) of consecutive frames from `begin` (c,) on, at most `life` (c,), that observe each candidate."""
    length = np.clip(np.minimum(life, len(t) - begin), 0, None)
    for start in range(0, len(length), _CHUNK):
        part = slice(start, min(start + _CHUNK, len(length)))
        row, frame = _expand(begin[part], length[part])
        row += start
        lost = np.flatnonzero(~sight.visible(frame, candidates.at(row, frame, t)))
        # of the frames at which a candidate is lost the first comes last, and stays
        length[row[lost][::-1]] = (frame - begin[row])[lost][::-1]
    return length


def _expand(begin: IntArray, length: IntArray) -> tuple[IntArray, IntArray]:
    """Rows (n,) and frames (n,) of c runs of frames."""
    row = np.repeat(np.arange(len(begin)), length)
    within = np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length)
    return row, begin[row] + within


def _top_up(birth: IntArray, length: IntArray, wanted: IntArray) -> BoolArray:
    """Mask (c,) of the candidates that are taken: at every frame as many as are missing, in their order."""
    chosen = np.zeros(len(birth), dtype=np.bool_)
    starts = np.searchsorted(birth, np.arange(len(wanted) + 1))
    ends = np.zeros(len(wanted) + int(length.max(initial=0)) + 1, dtype=np.int64)
    active = 0
    for frame, aim in enumerate(wanted.tolist()):
        active -= int(ends[frame])
        missing = aim - active
        if missing > 0:
            first = int(starts[frame])
            last = min(first + missing, int(starts[frame + 1]))
            chosen[first:last] = True
            np.add.at(ends, frame + length[first:last], 1)
            active += last - first
    return chosen
