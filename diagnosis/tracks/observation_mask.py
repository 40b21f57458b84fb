"""Mask of the observations that are consistent along their tracks, computed once and before any estimator."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem import Excluded
from fgbaseline.data.problem.documented import most_observed
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, disparity, se3
from fgbaseline.geometry.measurement_model import three_rows

GATE_RANGE = (3.0, 12.0)
"""px"""
GATE = 6.0
"""factor on the median prediction error"""


@dataclass(frozen=True, slots=True)
class MaskSettings:
    """Thresholds for an observation to be used."""

    min_disparity: float = 1.0
    """px; below it depth is not determined"""
    max_row_mismatch: float = 3.0
    """px; |vL - vR| of a rectified pair"""
    prediction_gate: float = 12.0
    """px; norm of (uL, uR, v) against the prediction from the track's observation before"""
    min_track: int = 3
    """observations of a track after masking, so that each can be checked against two others"""


class ConsistencyTest(Protocol):
    """Test whether two observations of a track agree on one static point."""

    def agree(self, before: IntArray, after: IntArray) -> BoolArray:
        """Mask (n,): whether observations `before` and `after` (n,), sorted by track, are of one track and agree."""


def exclusions(sequence: Sequence, world_T_imu: FloatArray, settings: MaskSettings) -> NDArray[np.uint8]:
    """`Excluded` (n,) of each observation, from the tracks and the dead-reckoned path (T, 4, 4) alone.

    Every observation of a track is predicted from the one before by stereo triangulation and the relative motion of the
    path. Consistent observations form runs. A single outlier between two consistent observations is excluded and the
    run continues. Of each track the longest run is used (ties: the first), since a track that jumps has changed its
    point.
    """
    test = TrackConsistency(sequence, world_T_imu, settings.prediction_gate)
    runs = _runs(sequence, test, settings, np.zeros(len(sequence.observations), dtype=np.bool_))
    excluded, kept, landmark = runs.excluded, runs.kept, sequence.observations.landmark
    in_longest = _longest_run_of_each_track(landmark[kept], runs.run)
    excluded[kept[~in_longest]] = Excluded.PREDICTION
    kept = kept[in_longest]
    left = np.bincount(landmark[kept], minlength=sequence.n_landmarks)
    excluded[kept[left[landmark[kept]] < settings.min_track]] = Excluded.SHORT
    return excluded


def choose_features(
    sequence: Sequence, excluded: NDArray[np.uint8], features: int | None
) -> tuple[IntArray, NDArray[np.uint8]]:
    """Landmarks observed most often after masking, at most `features`, and `excluded` (n,) for them.

    Observations of the other landmarks are `Excluded.FEATURE_NOT_CHOSEN`.
    """
    usable = sequence.observations.select(excluded == Excluded.NO)
    chosen = most_observed(usable, sequence.n_landmarks, features)
    left_out = (excluded == Excluded.NO) & ~np.isin(sequence.observations.landmark, chosen)
    return chosen, np.where(left_out, np.uint8(Excluded.FEATURE_NOT_CHOSEN), excluded)


@dataclass(frozen=True, eq=False, slots=True)
class SplitTracks:
    """Tracks split where they jump to another point."""

    landmark: IntArray
    """(n,) landmark of each observation; the longest run of a track keeps its number, other runs have new ones"""
    n_landmarks: int
    excluded: NDArray[np.uint8]
    """(n,) an `Excluded` each"""


def split_tracks(sequence: Sequence, test: ConsistencyTest, settings: MaskSettings, copied: BoolArray) -> SplitTracks:
    """Tracks split at jumps: every run of at least `min_track` observations is a landmark of its own.

    `test` tests two observations of a track; `copied` (n,) marks observations that repeat the frame before. The
    longest run of a track keeps its number.
    """
    runs = _runs(sequence, test, settings, copied)
    excluded, kept, landmark = runs.excluded, runs.kept, sequence.observations.landmark.copy()
    length = np.bincount(runs.run)
    long_enough = length >= settings.min_track
    excluded[kept[~long_enough[runs.run]]] = Excluded.SHORT
    in_longest = _longest_run_of_each_track(landmark[kept], runs.run)
    cut = np.zeros(len(length), dtype=np.bool_)
    cut[runs.run[~in_longest]] = True
    cut &= long_enough
    number = np.cumsum(cut) - 1 + sequence.n_landmarks
    moved = cut[runs.run]
    landmark[kept[moved]] = number[runs.run[moved]]
    return SplitTracks(landmark, sequence.n_landmarks + int(cut.sum()), excluded)


@dataclass(frozen=True, eq=False, slots=True)
class _Runs:
    excluded: NDArray[np.uint8]
    kept: IntArray
    """observations that are in a run, sorted by track"""
    run: IntArray
    """the run of each of these, increasing"""


def _runs(sequence: Sequence, test: ConsistencyTest, settings: MaskSettings, copied: BoolArray) -> _Runs:
    o = sequence.observations
    excluded = np.zeros(len(o), dtype=np.uint8)
    excluded[np.abs(o.pixel[:, 1] - o.pixel[:, 3]) > settings.max_row_mismatch] = Excluded.ROWS
    excluded[disparity(o.pixel) <= settings.min_disparity] = Excluded.DISPARITY
    excluded[copied] = Excluded.COPIED
    order = o.by_track()
    order = order[excluded[order] == Excluded.NO]
    kept, lone = _without_lone_outliers(test, o.landmark, order)
    excluded[lone] = Excluded.PREDICTION
    run = np.cumsum(np.r_[True, ~test.agree(kept[:-1], kept[1:])]) - 1 if len(kept) else kept
    return _Runs(excluded, kept, run)


def prediction_gate(errors: FloatArray) -> float:
    """Gate in px: `GATE` times the median of prediction errors (n,), within `GATE_RANGE`."""
    typical = float(np.median(errors)) if len(errors) else GATE_RANGE[1]
    return float(np.clip(GATE * typical, *GATE_RANGE))


class TrackConsistency:
    """Test whether two observations of a track agree on one static point, given the motion between them."""

    def __init__(self, sequence: Sequence, world_T_imu: FloatArray, gate: float) -> None:
        self.sequence = sequence
        self.world_T_cam = world_T_imu @ sequence.imu_T_cam
        self.gate = gate

    def error(self, before: IntArray, after: IntArray) -> FloatArray:
        """Distances (n,) in (uL, uR, v), px, of observations `after` (n,) from their prediction by `before` (n,).

        Infinite where the predicted point is not in front of the camera.
        """
        o, camera = self.sequence.observations, self.sequence.stereo_camera
        motion = se3.inverse(self.world_T_cam[o.frame[after]]) @ self.world_T_cam[o.frame[before]]
        predicted = se3.transform(motion, camera.triangulate_rows(three_rows(o.pixel[before])))
        residual = camera.project(predicted) - o.pixel[after]
        error = np.linalg.norm(three_rows(residual), axis=1)
        return np.where(predicted[:, 2] > 0, error, np.inf)

    def agree(self, before: IntArray, after: IntArray) -> BoolArray:
        """Mask (n,): whether both are of one track and within the gate."""
        landmark = self.sequence.observations.landmark
        same = landmark[before] == landmark[after]
        agree = np.zeros(len(before), dtype=np.bool_)
        agree[same] = self.error(before[same], after[same]) < self.gate
        return agree


def _without_lone_outliers(test: ConsistencyTest, landmark: IntArray, order: IntArray) -> tuple[IntArray, IntArray]:
    """`order` without the observations that disagree with both neighbors while these agree, and those taken out."""
    taken_out: list[IntArray] = []
    while len(order) >= 3:
        before, middle, after = order[:-2], order[1:-1], order[2:]
        one_track = landmark[before] == landmark[after]
        candidate = one_track & ~test.agree(before, middle) & ~test.agree(middle, after)
        candidate[candidate] = test.agree(before[candidate], after[candidate])
        if not candidate.any():
            break
        out = np.r_[False, candidate, False]
        taken_out.append(order[out])
        order = order[~out]
    return order, np.concatenate(taken_out) if taken_out else np.empty(0, dtype=np.int64)


def _longest_run_of_each_track(landmark: IntArray, run: IntArray) -> BoolArray:
    """Mask (n,): whether the run of each entry is the longest of its track (ties: the first); sorted by track."""
    if len(run) == 0:
        return np.empty(0, dtype=np.bool_)
    length = np.bincount(run)
    track_of_run = landmark[np.searchsorted(run, np.arange(len(length)))]
    by_length = np.lexsort((-length, track_of_run))
    first = np.r_[True, np.diff(track_of_run[by_length]) != 0]
    longest = np.zeros(len(length), dtype=np.bool_)
    longest[by_length[first]] = True
    return np.asarray(longest[run], dtype=np.bool_)
