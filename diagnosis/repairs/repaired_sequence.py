"""Repair of a recording by the significant estimates of its diagnosis."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.axis_conventions import twist_in_imu_axes
from fgbaseline.data.observations import Observations
from fgbaseline.data.problem import Excluded
from fgbaseline.data.sequence import Sequence, Truth
from fgbaseline.data.velocity_increments import dead_reckoned_path, zero_order_hold
from fgbaseline.data.wording import signed, vector
from fgbaseline.geometry import FloatArray, so3

from ..body_velocity.result import Diagnosis
from ..odometry.stereo_odometry import Odometry, odometry
from ..tracks.observation_mask import (
    GATE_RANGE,
    MaskSettings,
    SplitTracks,
    TrackConsistency,
    prediction_gate,
    split_tracks,
)
from ..tracks.track_segments import consecutive, is_usable
from .landmark_mask import exclude_landmarks
from .significance import significant_bias, significant_misalignment, significant_offset, significant_scale


@dataclass(frozen=True, slots=True)
class TrackRepairs:
    """Settings for the repair of tracks."""

    gate: float | None = None
    """px, largest distance of an observation from its prediction along the track; None: estimated"""
    split: bool = True
    """whether a track that jumps is split into landmarks; otherwise only its longest consistent run is used"""
    mask_copies: bool = True
    """whether observations equal to those of the previous frame to the bit are masked"""


@dataclass(frozen=True, eq=False, slots=True)
class Repaired:
    """A repaired recording, the mask of its observations, and the repairs in sentences."""

    sequence: Sequence
    excluded: NDArray[np.uint8]
    """(n,) `Excluded` code of each observation of `sequence`"""
    gate: float
    """px, largest distance of an observation from its prediction along the track"""
    repairs: tuple[str, ...]


def repair(diagnosis: Diagnosis, mask: MaskSettings, tracks: TrackRepairs | None = None) -> Repaired:
    """Applies the significant estimates of a diagnosis to its recording, and masks and splits its tracks.

    Velocities are rotated to the axes of imu_T_cam, scaled, and freed of the gyroscope's bias; the extrinsic is rotated
    to agree with them; an offset of the disparities is subtracted. `tracks` sets how tracks are repaired.
    """
    sequence, done = diagnosis.sequence, []
    linear, angular = diagnosis.linear, diagnosis.angular
    bias, angle = significant_bias(diagnosis), significant_misalignment(diagnosis)
    scale, tracks = significant_scale(diagnosis), tracks or TrackRepairs()
    velocity = sequence.linear_velocity @ linear.matrix.T / scale
    rate = (sequence.angular_velocity - bias) @ angular.matrix.T
    if bias.any():
        done.append(f"gyroscope bias of {vector(bias, 4)} rad/s, in the recorded axes, subtracted")
    if angular.changed:
        done.append(f"angular velocity rotated from the recorded axes ({angular.name}) to the IMU axes of imu_T_cam")
    if linear.changed:
        done.append(f"linear velocity rotated from the recorded axes ({linear.name}) to the IMU axes of imu_T_cam")
    if scale != 1.0:
        done.append(f"linear velocity divided by {scale:.4g}")
    imu_T_cam = sequence.imu_T_cam.copy()
    if angle.any():
        imu_T_cam[:3, :3] = so3.exp_so3(angle) @ imu_T_cam[:3, :3]
        done.append(
            f"extrinsic imu_T_cam rotated by {np.rad2deg(np.linalg.norm(angle)):.2f}° to agree with the velocities"
        )
    offset = significant_offset(diagnosis)
    if offset:
        sequence = _without_offset(sequence, offset)
        done.append(f"uR {'reduced' if offset > 0 else 'increased'} by {abs(offset):.2f} px")
    if diagnosis.shift != 0.0:
        done.append(f"velocities shifted by {signed(diagnosis.shift, 2)} intervals{_estimated_shift(diagnosis)}")
    path = _path(diagnosis, odometry(sequence) if offset else diagnosis.odometry)
    sigma = GATE_RANGE[0] if diagnosis.sigmas is None else diagnosis.sigmas.pixel
    found = repaired_tracks(sequence, path, mask, tracks, sigma)
    done += found.repairs
    repaired = replace(
        sequence,
        linear_velocity=velocity,
        angular_velocity=rate,
        imu_T_cam=imu_T_cam,
        observations=found.observations,
        n_landmarks=found.n_landmarks,
        truth=truth_of_landmarks(sequence.truth, found.n_landmarks),
    )
    return Repaired(repaired, found.excluded, found.gate, tuple(done))


class RepairedTracks(NamedTuple):
    """Observations under their new landmarks, and the mask."""

    observations: Observations
    n_landmarks: int
    excluded: NDArray[np.uint8]
    """(n,) `Excluded` code of each observation"""
    gate: float
    """px, largest distance of an observation from its prediction along the track"""
    repairs: tuple[str, ...]


def repaired_tracks(
    sequence: Sequence, path: FloatArray, mask: MaskSettings, tracks: TrackRepairs, sigma: float
) -> RepairedTracks:
    """Tracks split where they jump, and the mask of their observations.

    Observations are predicted along `path` (T, 4, 4), of which only motions over a few frames matter; `sigma` is their
    noise, px.
    """
    found = renumbered_tracks(sequence, *_split(sequence, path, mask, tracks))
    tracked = replace(sequence, observations=found.observations, n_landmarks=found.n_landmarks, truth=None)
    return found._replace(excluded=exclude_landmarks(tracked, path, found.excluded, sigma))


def _estimated_shift(diagnosis: Diagnosis) -> str:
    """Clause with the estimated shift, where a convention near it was applied in its place; otherwise empty."""
    estimated = diagnosis.timing.shift / float(np.median(diagnosis.sequence.dt))
    text = signed(estimated, 2)
    if "shift_intervals" in diagnosis.overrides or not diagnosis.timing.identifiable:
        return ""
    return "" if text == signed(diagnosis.shift, 2) else f", the convention nearest to the estimated {text}"


def _without_offset(sequence: Sequence, offset: float) -> Sequence:
    o = sequence.observations
    return replace(sequence, observations=replace(o, pixel=o.pixel - [0.0, 0.0, offset, 0.0]))


def _path(diagnosis: Diagnosis, visual: Odometry | None) -> FloatArray:
    """Path (T, 4, 4) along which observations are predicted over a few frames; it drifts.

    An interval has the twist of visual odometry if that is known, the mean of both neighbors' if only these are, and
    otherwise the repaired velocities.
    """
    sequence = diagnosis.sequence
    twist = twist_in_imu_axes(zero_order_hold(sequence, diagnosis.shift), diagnosis.linear.name, diagnosis.angular.name)
    twist[:, :3] /= significant_scale(diagnosis)
    twist[:, 3:] -= diagnosis.angular.matrix @ significant_bias(diagnosis)
    if visual is not None:
        visual_twist, known = visual.twist(sequence.dt), visual.known
        twist[known] = visual_twist[known]
        between = np.flatnonzero(~known[1:-1] & known[:-2] & known[2:]) + 1
        twist[between] = 0.5 * (visual_twist[between - 1] + visual_twist[between + 1])
    return dead_reckoned_path(twist * sequence.dt[:, None])


def _split(sequence: Sequence, path: FloatArray, mask: MaskSettings, tracks: TrackRepairs) -> tuple[SplitTracks, float]:
    """Tracks split where they jump, with their mask, and the gate, px."""
    o = sequence.observations
    copied = np.zeros(len(o), dtype=np.bool_)
    before, after = consecutive(sequence)
    same = (o.pixel[before] == o.pixel[after]).all(axis=1)
    if tracks.mask_copies:
        copied[after[same]] = True
    gate = tracks.gate
    if gate is None:
        consistency, usable = TrackConsistency(sequence, path, mask.prediction_gate), is_usable(sequence)
        checked = usable[before] & usable[after] & ~same
        gate = prediction_gate(consistency.error(before[checked], after[checked]))
    split = split_tracks(sequence, TrackConsistency(sequence, path, gate), mask, copied)
    if not tracks.split:
        split.excluded[split.landmark != o.landmark] = Excluded.PREDICTION
        split = SplitTracks(o.landmark, sequence.n_landmarks, split.excluded)
    return split, gate


def renumbered_tracks(sequence: Sequence, split: SplitTracks, gate: float) -> RepairedTracks:
    """Observations and mask of split tracks, sorted by frame and new landmark; `gate`, px, is that of the split."""
    o = sequence.observations
    order = np.lexsort((split.landmark, o.frame))
    moved = Observations(o.frame[order], split.landmark[order], o.pixel[order])
    pieces, done = split.n_landmarks - sequence.n_landmarks, tuple[str, ...]()
    if pieces:
        n = len(np.unique(o.landmark))
        done = (
            "tracks split where they jump to another point (wrong matches; the mask excludes new tracks that are too "
            f"short): {n + pieces:,} tracks from {n:,}",
        )
    return RepairedTracks(moved, split.n_landmarks, split.excluded[order], gate, done)


def truth_of_landmarks(truth: Truth | None, n_landmarks: int) -> Truth | None:
    """Ground truth with a row of NaN for each landmark that a split has added."""
    if truth is None or truth.landmarks is None:
        return truth
    missing = np.full((n_landmarks - len(truth.landmarks), 3), np.nan)
    return replace(truth, landmarks=np.concatenate([truth.landmarks, missing]))
