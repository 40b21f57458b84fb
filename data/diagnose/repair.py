"""The recording as it should have been: what the diagnosis is sure of, put right."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FloatArray, so3

from ..motion import dead_reckoned_path, held_twist
from ..observations import Observations
from ..problem import Excluded
from ..sequence import Sequence, Truth
from ..track_mask import MaskSettings, SplitTracks, TrackLinks, split_tracks
from .diagnosis import Diagnosis, turned
from .links import consecutive, sound
from .odometry import Odometry, odometry
from .points import judged

SURE = 4.0
"""standard errors, from which on a figure counts as found"""
MIN_BIAS = 0.002
"""rad/s"""
MIN_MISALIGNMENT = np.deg2rad(0.25)
MIN_OFFSET = 0.05
"""px"""
GATE_RANGE = (3.0, 12.0)
"""px"""
GATE = 6.0
"""times the median error of a link"""


@dataclass(frozen=True, slots=True)
class TrackRepairs:
    """What is done to tracks."""

    gate: float | None = None
    """px, of a link's prediction; None for `GATE` times the median error"""
    split: bool = True
    """whether every run of a track that jumps becomes a landmark of its own, or only the longest takes part"""
    mask_copies: bool = True


@dataclass(frozen=True, eq=False, slots=True)
class Repaired:
    """A repaired recording, which of its observations can be trusted, and what was done."""

    sequence: Sequence
    excluded: NDArray[np.uint8]
    """(n,) an `Excluded` for each of its observations"""
    gate: float
    """px: how far from its prediction an observation may lie"""
    repairs: tuple[str, ...]


def sure_bias(diagnosis: Diagnosis) -> FloatArray:
    """(3,) rad/s in recorded axes; zero where the bias is too small or too uncertain to be taken off."""
    bias, deviation = diagnosis.gyro_bias, diagnosis.gyro_bias_deviation
    if "gyro_bias" in diagnosis.by_hand:
        return bias
    found = (np.abs(bias) > MIN_BIAS) & (np.abs(bias) > SURE * deviation)
    return bias if found.any() else np.zeros(3)


def sure_misalignment(diagnosis: Diagnosis) -> FloatArray:
    """(3,) rad; zero in each component that is too small or too uncertain."""
    angle, deviation = diagnosis.misalignment
    if "misalignment_deg" in diagnosis.by_hand:
        return angle
    return np.where((np.abs(angle) > MIN_MISALIGNMENT) & (np.abs(angle) > SURE * deviation), angle, 0.0)


def sure_scale(diagnosis: Diagnosis) -> float:
    """By which velocities are divided: 1 unless set by hand, since it could as well be the stereo's that is wrong."""
    return diagnosis.velocity_scale[0] if "velocity_scale" in diagnosis.by_hand else 1.0


def sure_offset(diagnosis: Diagnosis) -> float:
    """px; zero where the disparity offset is too small or too uncertain."""
    offset, deviation = diagnosis.disparity_offset
    if "disparity_offset_px" in diagnosis.by_hand:
        return offset
    return offset if abs(offset) > max(MIN_OFFSET, SURE * deviation) else 0.0


def repair(diagnosis: Diagnosis, mask: MaskSettings, tracks: TrackRepairs | None = None) -> Repaired:
    """Velocities in the axes of imu_T_cam without their bias, the extrinsic turned, disparities without their offset,
    broken tracks split."""
    sequence, done = diagnosis.sequence, []
    linear, angular = diagnosis.linear, diagnosis.angular
    bias, angle = sure_bias(diagnosis), sure_misalignment(diagnosis)
    scale, tracks = sure_scale(diagnosis), tracks or TrackRepairs()
    velocity = sequence.linear_velocity @ linear.matrix.T / scale
    rate = (sequence.angular_velocity - bias) @ angular.matrix.T
    if angular.changed:
        done.append(f"angular velocity turned from the axes it was recorded in ({angular.name}) to those of imu_T_cam")
    if linear.changed:
        done.append(f"linear velocity turned from the axes it was recorded in ({linear.name}) to those of imu_T_cam")
    if bias.any():
        done.append(f"gyroscope bias of ({', '.join(f'{b:.4f}' for b in bias)}) rad/s taken off")
    if scale != 1.0:
        done.append(f"linear velocity divided by {scale:.4g}")
    imu_T_cam = sequence.imu_T_cam.copy()
    if angle.any():
        imu_T_cam[:3, :3] = so3.exp_so3(angle) @ imu_T_cam[:3, :3]
        done.append(
            f"extrinsic imu_T_cam turned by {np.rad2deg(np.linalg.norm(angle)):.2f}° to agree with the velocities"
        )
    offset = sure_offset(diagnosis)
    if offset:
        sequence = _without_offset(sequence, offset)
        done.append(f"{offset:+.2f} px taken off every uR, so that disparities agree with the motion")
    if diagnosis.shift != 0.0:
        done.append(f"velocities shifted by {diagnosis.shift:+.2f} intervals")
    path = _path(diagnosis, odometry(sequence) if offset else diagnosis.odometry)
    split, gate = _split(sequence, path, mask, tracks)
    observations, excluded = _renumbered(sequence, split)
    pieces = split.n_landmarks - sequence.n_landmarks
    n_landmarks = sequence.n_landmarks + pieces
    if pieces:
        done.append(f"{pieces} tracks that jump to another point split off as landmarks of their own")
    tracked = replace(sequence, observations=observations, n_landmarks=n_landmarks, truth=None)
    sigma = GATE_RANGE[0] if diagnosis.sigmas is None else diagnosis.sigmas.pixel
    excluded = judged(tracked, path, excluded, sigma)
    repaired = replace(
        sequence,
        linear_velocity=velocity,
        angular_velocity=rate,
        imu_T_cam=imu_T_cam,
        observations=observations,
        n_landmarks=n_landmarks,
        truth=_with_landmarks(sequence.truth, n_landmarks),
    )
    return Repaired(repaired, excluded, gate, tuple(done))


def _without_offset(sequence: Sequence, offset: float) -> Sequence:
    o = sequence.observations
    return replace(sequence, observations=replace(o, pixel=o.pixel - [0.0, 0.0, offset, 0.0]))


def _path(diagnosis: Diagnosis, seen_by_cameras: Odometry | None) -> FloatArray:
    """(T, 4, 4) a path that is right locally, which is all it is for: what the cameras see, and between two intervals
    that they see what lies in their middle; elsewhere the velocities."""
    sequence = diagnosis.sequence
    twist = turned(held_twist(sequence, diagnosis.shift), diagnosis.linear.name, diagnosis.angular.name)
    twist[:, :3] /= sure_scale(diagnosis)
    twist[:, 3:] -= diagnosis.angular.matrix @ sure_bias(diagnosis)
    if seen_by_cameras is not None:
        seen, known = seen_by_cameras.twist(sequence.dt), seen_by_cameras.known
        twist[known] = seen[known]
        between = np.flatnonzero(~known[1:-1] & known[:-2] & known[2:]) + 1
        twist[between] = 0.5 * (seen[between - 1] + seen[between + 1])
    return dead_reckoned_path(twist * sequence.dt[:, None])


def _split(sequence: Sequence, path: FloatArray, mask: MaskSettings, tracks: TrackRepairs) -> tuple[SplitTracks, float]:
    """Tracks cut where they jump, what excludes their observations, and the gate by which they were judged."""
    o = sequence.observations
    copied = np.zeros(len(o), dtype=np.bool_)
    before, after = consecutive(sequence)
    same = (o.pixel[before] == o.pixel[after]).all(axis=1)
    if tracks.mask_copies:
        copied[after[same]] = True
    gate = tracks.gate
    if gate is None:
        links, usable = TrackLinks(sequence, path, mask.prediction_gate), sound(sequence)
        judged = usable[before] & usable[after] & ~same
        typical = float(np.median(links.error(before[judged], after[judged]))) if judged.any() else GATE_RANGE[1]
        gate = float(np.clip(GATE * typical, *GATE_RANGE))
    split = split_tracks(sequence, path, replace(mask, prediction_gate=gate), copied)
    if not tracks.split:
        split.excluded[split.landmark != o.landmark] = Excluded.PREDICTION
        split = SplitTracks(o.landmark, sequence.n_landmarks, split.excluded)
    return split, gate


def _renumbered(sequence: Sequence, split: SplitTracks) -> tuple[Observations, NDArray[np.uint8]]:
    """Observations under their new landmarks, in their order, and what excludes them."""
    o = sequence.observations
    order = np.lexsort((split.landmark, o.frame))
    moved = Observations(o.frame[order], split.landmark[order], o.pixel[order])
    return moved, split.excluded[order]


def _with_landmarks(truth: Truth | None, n_landmarks: int) -> Truth | None:
    """The truth, with landmarks of unknown position for the tracks that were split off."""
    if truth is None or truth.landmarks is None:
        return truth
    missing = np.full((n_landmarks - len(truth.landmarks), 3), np.nan)
    return replace(truth, landmarks=np.concatenate([truth.landmarks, missing]))
