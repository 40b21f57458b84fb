"""Track segments: pairs of observations of one landmark in consecutive frames."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray, Observations
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, disparity
from fgbaseline.geometry.measurement_model import three_rows

MIN_DISPARITY = 1.0
"""px"""
MAX_ROW_MISMATCH = 3.0
"""px, |vL - vR|"""
BLOCK = 8000
"""segments, whose arrays fit into a processor's cache"""
REPEATED_SHARE = 0.8
"""share of the segments of an interval, from which on its tracks count as copied"""


@dataclass(frozen=True, eq=False, slots=True)
class TrackSegments:
    """n segments sorted by frame: a landmark observed in a frame and in the next one."""

    before: IntArray
    """(n,) index of the observation in frame k"""
    after: IntArray
    """(n,) index of the observation in frame k + 1"""
    frame: IntArray
    """(n,) k"""
    point: FloatArray
    """(n, 3) m, the landmark in the left camera's frame at k, from its disparity and mean row"""
    pixel: FloatArray
    """(n, 3) uL, uR and (vL + vR) / 2 at k + 1, px"""

    def __len__(self) -> int:
        return len(self.before)

    def select(self, chosen: BoolArray | IntArray) -> "TrackSegments":
        """The segments where `chosen` is true, or those at increasing indices."""
        return TrackSegments(*(getattr(self, name)[chosen] for name in self.__slots__))

    def blocks(self, size: int = BLOCK) -> Iterator[slice]:
        """Slices of about `size` segments, each with all segments of its frames."""
        ends = np.searchsorted(self.frame, self.frame[size - 1 :: size], side="right").tolist()
        start = 0
        for end in (*ends, len(self)):
            if end > start:
                yield slice(start, end)
                start = end


def is_usable(sequence: Sequence) -> BoolArray:
    """Mask (n,) of the observations whose disparity and rows allow triangulation; all True for one camera."""
    if sequence.monocular:
        return np.ones(len(sequence.observations), dtype=np.bool_)
    pixel = sequence.observations.pixel
    rows = np.abs(pixel[:, 1] - pixel[:, 3]) <= MAX_ROW_MISMATCH
    return np.asarray(rows & (disparity(pixel) > MIN_DISPARITY), dtype=np.bool_)


def consecutive(sequence: Sequence) -> tuple[IntArray, IntArray]:
    """Indices (n,) of observations and (n,) of those of the same landmark one frame later, sorted by frame."""
    o = sequence.observations
    order = o.by_track()
    before, after = order[:-1], order[1:]
    linked = (o.landmark[before] == o.landmark[after]) & (o.frame[before] + 1 == o.frame[after])
    before, after = before[linked], after[linked]
    by_frame = np.argsort(o.frame[before], kind="stable")
    return before[by_frame], after[by_frame]


def repeated(sequence: Sequence) -> BoolArray:
    """Mask (T-1,) of the intervals with copied tracks: nearly all pixels equal those of the previous frame to the bit.

    A copied frame holds no motion, and its tracks often continue as other points. Sub-pixel positions of a tracker are
    never equal by chance, even for a camera at rest.
    """
    o, n = sequence.observations, sequence.n_frames - 1
    before, after = consecutive(sequence)
    same = (o.pixel[before] == o.pixel[after]).all(axis=1)
    count = np.bincount(o.frame[before], minlength=n)
    equal = np.bincount(o.frame[before[same]], minlength=n)
    return np.asarray((count >= 3) & (equal > REPEATED_SHARE * count), dtype=np.bool_)


def track_segments(sequence: Sequence) -> TrackSegments:
    """All segments between usable observations, without intervals of copied tracks."""
    o = sequence.observations
    before, after = consecutive(sequence)
    use = is_usable(sequence)
    chosen = use[before] & use[after] & ~repeated(sequence)[o.frame[before]]
    before, after = before[chosen], after[chosen]
    return TrackSegments(
        before=before,
        after=after,
        frame=o.frame[before],
        point=sequence.stereo_camera.triangulate_rows(three_rows(o.pixel[before])),
        pixel=three_rows(o.pixel[after]),
    )


def track_chains(before: IntArray, after: IntArray, inlier: BoolArray, o: Observations) -> IntArray:
    """Chain numbers (n,) of the observations: equal for those that inlier segments join, -1 without such a segment.

    `before` and `after` (m,) are the observations of the segments, `inlier` (m,) those that agree with the motion.
    """
    n = len(o)
    linked, joined = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    joined[after[inlier]] = True
    linked[after[inlier]] = linked[before[inlier]] = True
    order = o.by_track()
    chain = np.empty(n, dtype=np.int64)
    chain[order] = np.cumsum(~joined[order])
    return np.where(linked, chain, -1)
