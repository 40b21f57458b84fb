"""Mask of the tracks of one camera: what leaves the epipolar lines of the motion that its frame's others show.

Along its line a track may not pass infinity, nor come far nearer than its frame's points. A wrong match that stays
within, and an object that moves within, pass: kernel and gates are for them.
"""

from dataclasses import replace

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem import Excluded
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray

from ...odometry.epipolar_motion import beyond_scene, epipolar_motions
from ...odometry.monocular_odometry import ray_matches, track_pairs
from ...repairs.repaired_sequence import RepairedTracks, renumbered_tracks, truth_of_landmarks
from ...tracks.observation_mask import MaskSettings, prediction_gate, split_tracks
from ...tracks.track_segments import consecutive

STEPS = (1, 2, 3)
"""frames between compared observations: more than one, so that a track survives a single wrong match"""

PIXEL = 0.5
"""px, least noise of a row: errors of a tracker that are smaller from frame to frame are shared by its tracks"""


class EpipolarConsistency:
    """Test whether two observations of a track lie in one epipolar plane, by the motion between their frames."""

    def __init__(self, sequence: Sequence) -> None:
        self._observations = sequence.observations
        self.error: dict[int, FloatArray] = {}
        """step -> (n,) px, by which an observation and the one that many frames later leave their epipolar line, or
        the scene along it; NaN where there is none, or no motion is known"""
        for step in STEPS:
            before, after = track_pairs(sequence, step)
            matches = ray_matches(sequence, before, after)
            found = epipolar_motions(matches, sequence.n_frames - 1)
            across, along = np.sqrt(found.whitened_squared) * found.sigma, beyond_scene(matches, found.motion)
            along = np.where(found.directed(PIXEL / sequence.camera.fu)[matches.pair], along, 0.0)
            self.error[step] = np.full(len(sequence.observations), np.nan)
            self.error[step][before] = np.maximum(across, along) * sequence.camera.fu
        self.gate = prediction_gate(self.error[1][np.isfinite(self.error[1])])
        """px"""

    def agree(self, before: IntArray, after: IntArray) -> BoolArray:
        """Mask (n,): whether both are of one track and no known motion contradicts."""
        o = self._observations
        apart, agree = o.frame[after] - o.frame[before], o.landmark[after] == o.landmark[before]
        for step, error in self.error.items():
            agree &= ~((apart == step) & (error[before] > self.gate))
        return np.asarray(agree, dtype=np.bool_)


def monocular_tracks(sequence: Sequence) -> RepairedTracks:
    """Tracks split where they jump, and the mask."""
    o = sequence.observations
    before, after = consecutive(sequence)
    copied = np.zeros(len(o), dtype=np.bool_)
    copied[after[(o.pixel[before, :2] == o.pixel[after, :2]).all(axis=1)]] = True
    test = EpipolarConsistency(sequence)
    return renumbered_tracks(sequence, split_tracks(sequence, test, MaskSettings(), copied), test.gate)


def used(sequence: Sequence, tracks: RepairedTracks) -> Sequence:
    """The recording with its tracks as repaired and without what the mask excludes."""
    found = repaired(sequence, tracks)
    return replace(found, observations=found.observations.select(tracks.excluded == Excluded.NO))


def repaired(sequence: Sequence, tracks: RepairedTracks) -> Sequence:
    """The recording with its tracks as repaired."""
    truth = truth_of_landmarks(sequence.truth, tracks.n_landmarks)
    return replace(sequence, observations=tracks.observations, n_landmarks=tracks.n_landmarks, truth=truth)
