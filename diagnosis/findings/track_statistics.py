"""Statistics of tracks: unusable observations, and track segments that contradict the odometry of their interval."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, disparity

from ..body_velocity.result import Diagnosis
from ..odometry.ransac import TRUNCATION
from ..repairs.repaired_sequence import Repaired, repair
from ..tracks.observation_mask import MaskSettings
from ..tracks.track_segments import MAX_ROW_MISMATCH, MIN_DISPARITY, consecutive, is_usable

BURST = 1.0 / 3.0
"""share of wrong matches above which an interval is a burst of them"""
BURST_MATCHES = 5
"""smallest number of wrong matches in a burst, so that an interval with few features is none"""
WRONG_PIXEL = 0.5
"""px: usual noise of the rows; segments within four sigmas of it are not wrong"""
MOVING_MATCHES = 5
"""consecutive matches of a track that contradict the motion: a wrong match contradicts it once or twice"""
MIN_USABLE = 6
"""features of a frame, below which odometry has no motion"""
GAP = 2.5
"""factor on the median interval above which an interval is a gap"""


@dataclass(frozen=True, eq=False, slots=True)
class TrackStatistics:
    """Counts over the observations, frames and intervals of a recording."""

    not_positive: int
    """observations whose disparity is zero or less"""
    tiny: int
    """observations whose disparity is positive and at most `track_segments.MIN_DISPARITY`"""
    rows: int
    """observations with |vL - vR| above `track_segments.MAX_ROW_MISMATCH`"""
    copied: int
    """observations that are the same to the bit as the frame before, in intervals whose tracks are copies"""
    usable: IntArray
    """(T,) observations of each frame that can be triangulated"""
    matches: IntArray
    """(T-1,) track segments over each interval with a known motion"""
    wrong: IntArray
    """(T-1,) matches that contradict the motion of their interval"""
    wrong_after: float
    """share of wrong matches among those that repair and mask leave"""
    bursts_after: int
    """intervals with a `burst` among the matches that repair and mask leave"""
    moving: int
    """tracks that contradict the motion over `MOVING_MATCHES` intervals in succession"""
    moving_after: int
    """count as `moving`, over the matches that repair and mask leave"""
    gaps: IntArray
    """intervals longer than `GAP` times the median"""

    @property
    def wrong_share(self) -> FloatArray:
        """Shares (T-1,) of matches that contradict the motion of their interval; NaN where it is unknown."""
        return np.where(self.matches > 0, self.wrong / np.maximum(self.matches, 1), np.nan)

    @property
    def burst(self) -> BoolArray:
        """Mask (T-1,) of the intervals in which a third or more of the matches contradict the motion."""
        return _burst(self.wrong, self.matches)

    @property
    def few(self) -> BoolArray:
        """Mask (T,) of the frames with fewer than `MIN_USABLE` usable features."""
        return np.asarray(self.usable < MIN_USABLE, dtype=np.bool_)


def track_statistics(diagnosis: Diagnosis, repaired: Repaired | None = None) -> TrackStatistics:
    """Statistics of the tracks of a diagnosed recording; `repaired` is `repair(diagnosis, MaskSettings())`."""
    sequence = diagnosis.sequence
    o, n = sequence.observations, sequence.n_frames - 1
    apart = disparity(o.pixel)
    matches, wrong, moving, moving_after = np.zeros(n, np.int64), np.zeros(n, np.int64), 0, 0
    after, bursts_after = 0.0, 0
    odometry = diagnosis.odometry
    if odometry is not None:
        known = odometry.known[odometry.segments.frame]
        floor = max(1.0, WRONG_PIXEL / odometry.pixel_sigma)
        outlier = known & (odometry.whitened_squared > TRUNCATION * floor**2)
        matches = np.bincount(odometry.segments.frame[known], minlength=n)
        wrong = np.bincount(odometry.segments.frame[outlier], minlength=n)
        moving = _moving(o.landmark[odometry.segments.after], odometry.segments.frame, outlier)
        repaired = repaired or repair(diagnosis, MaskSettings())
        left = known & _left(sequence, repaired, odometry.segments.before, odometry.segments.after)
        after = float(outlier[left].mean()) if left.any() else 0.0
        by_interval = [np.bincount(odometry.segments.frame[which], minlength=n) for which in (outlier & left, left)]
        bursts_after = int(_burst(*by_interval).sum())
        moving_after = _moving(o.landmark[odometry.segments.after], odometry.segments.frame, outlier & left)
    return TrackStatistics(
        not_positive=int(np.sum(apart <= 0)),
        tiny=int(np.sum((apart > 0) & (apart <= MIN_DISPARITY))),
        rows=int(np.sum(np.abs(o.pixel[:, 1] - o.pixel[:, 3]) > MAX_ROW_MISMATCH)),
        copied=_copied(sequence, diagnosis.repeated),
        usable=np.bincount(o.frame[is_usable(sequence)], minlength=n + 1),
        matches=matches,
        wrong=wrong,
        wrong_after=after,
        bursts_after=bursts_after,
        moving=moving,
        moving_after=moving_after,
        gaps=np.flatnonzero(sequence.dt > GAP * np.median(sequence.dt)),
    )


def _burst(wrong: IntArray, matches: IntArray) -> BoolArray:
    return np.asarray((wrong >= BURST_MATCHES) & (wrong > BURST * matches), dtype=np.bool_)


def _copied(sequence: Sequence, repeated: BoolArray) -> int:
    if not repeated.any():
        return 0
    o = sequence.observations
    before, after = consecutive(sequence)
    same = (o.pixel[before] == o.pixel[after]).all(axis=1)
    return int(np.sum(same & repeated[o.frame[before]]))


def _moving(landmark: IntArray, frame: IntArray, outlier: BoolArray) -> int:
    """Number of landmarks with `MOVING_MATCHES` outlier matches in succession."""
    order = np.lexsort((frame, landmark))
    landmark, frame, outlier = landmark[order], frame[order], outlier[order]
    same = (landmark[1:] == landmark[:-1]) & (frame[1:] == frame[:-1] + 1) & (outlier[1:] == outlier[:-1])
    run = np.cumsum(~np.r_[False, same]) - 1
    if len(run) == 0:
        return 0
    long_enough = np.bincount(run) >= MOVING_MATCHES
    return len(np.unique(landmark[outlier & long_enough[run]]))


def _left(sequence: Sequence, repaired: Repaired, before: IntArray, after: IntArray) -> BoolArray:
    """Mask (n,) of the matches whose two observations are in one track of the repaired and masked recording."""
    o, now = sequence.observations, repaired.sequence.observations
    # The repair gives observations other landmarks, and with them another order within their frame.
    was, is_now = (np.lexsort((*x.pixel.T, x.frame)) for x in (o, now))
    excluded, landmark = np.empty(len(o), np.uint8), np.empty(len(o), np.int64)
    excluded[was], landmark[was] = repaired.excluded[is_now], now.landmark[is_now]
    kept = (excluded[before] == 0) & (excluded[after] == 0)
    return np.asarray(kept & (landmark[before] == landmark[after]), dtype=np.bool_)
