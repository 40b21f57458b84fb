"""Tracks of one camera in a few keyframes: as rays in the axes of the IMU, and as a term of least squares."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, se3
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.triangulation import triangulate_tracks

from ...inertial_initialization.structureless_factors import KeyframeTracks

MIN_OBSERVATIONS = 3
"""observations of a track among the keyframes"""


@dataclass(frozen=True, eq=False, slots=True)
class Rays:
    """n observations of m points as rays."""

    keyframe: IntArray
    """(n,) sorted"""
    point: IntArray
    """(n,) 0..m-1"""
    direction: FloatArray
    """(n, 3) unit vectors in the axes of the IMU"""

    def common(self, i: int, j: int) -> tuple[FloatArray, FloatArray]:
        """Directions (k, 3) of the points that two keyframes share, from each of them."""
        first, second = np.flatnonzero(self.keyframe == i), np.flatnonzero(self.keyframe == j)
        _, at, after = np.intersect1d(self.point[first], self.point[second], return_indices=True)
        return self.direction[first[at]], self.direction[second[after]]


def keyframe_tracks(sequence: Sequence, frames: IntArray, sigma: float) -> KeyframeTracks:
    """Tracks with at least `MIN_OBSERVATIONS` of the keyframes `frames` (k,), with `sigma` px of each row."""
    chosen, place = _in_keyframes(sequence, frames)
    return _tracks(sequence, chosen, place, sigma)


def every_second_track(sequence: Sequence, frames: IntArray, sigma: float) -> tuple[KeyframeTracks, BoolArray]:
    """Every second of the `keyframe_tracks`, and the mask (n,) of their observations."""
    chosen, place = _in_keyframes(sequence, frames)
    track = np.unique(sequence.observations.landmark[chosen], return_inverse=True)[1]
    chosen = chosen[track % 2 == 0]
    used = np.zeros(len(sequence.observations), dtype=np.bool_)
    used[chosen] = True
    return _tracks(sequence, chosen, place, sigma), used


def _in_keyframes(sequence: Sequence, frames: IntArray) -> tuple[IntArray, IntArray]:
    """Observations (m,) of the tracks with enough of the keyframes, and the number (T,) of each frame among these."""
    o = sequence.observations
    place = np.full(sequence.n_frames, -1, dtype=np.int64)
    place[frames] = np.arange(len(frames))
    chosen = np.flatnonzero(place[o.frame] >= 0)
    _, row, count = np.unique(o.landmark[chosen], return_inverse=True, return_counts=True)
    return chosen[count[row] >= MIN_OBSERVATIONS], place


def _tracks(sequence: Sequence, chosen: IntArray, place: IntArray, sigma: float) -> KeyframeTracks:
    o = sequence.observations
    point = np.unique(o.landmark[chosen], return_inverse=True)[1].astype(np.int64)
    model = MeasurementModel(sequence.camera, sigma**2, HuberKernel())
    return KeyframeTracks(model, sequence.imu_T_cam, place[o.frame[chosen]], point, o.pixel[chosen])


def rays_of(tracks: KeyframeTracks) -> Rays:
    """The tracks as rays."""
    camera = tracks.model.camera
    ray = np.ones((len(tracks.pixel), 3))
    ray[:, :2] = (tracks.pixel[:, :2] - [camera.cu, camera.cv]) / [camera.fu, camera.fv]
    ray = ray @ tracks.imu_T_cam[:3, :3].T
    return Rays(tracks.keyframe, tracks.point, ray / np.linalg.norm(ray, axis=1, keepdims=True))


def squared_residuals(tracks: KeyframeTracks, pose: FloatArray, points: FloatArray) -> FloatArray:
    """Squared whitened residuals (n,) of the tracks along poses (k, 4, 4); NaN behind a camera or without a point."""
    cam_T_imu, model = se3.inverse(tracks.imu_T_cam), tracks.model
    squared = np.full(len(tracks.point), np.nan)
    for i, world_T_imu in enumerate(pose):
        at = np.flatnonzero(tracks.keyframe == i)
        seen = predict(model.camera, cam_T_imu, world_T_imu, points[tracks.point[at]])
        residual = (model.rows_of(tracks.pixel[at]) - seen.pixel) * model.whitening_scale
        squared[at] = np.where(seen.depth > model.camera.min_depth, np.sum(residual**2, axis=1), np.nan)
    return squared


def window_points(tracks: KeyframeTracks, pose: FloatArray) -> FloatArray:
    """Points (m, 3) of the tracks along poses (k, 4, 4); NaN without parallax."""
    world_T_cam = (pose @ tracks.imu_T_cam)[tracks.keyframe]
    return triangulate_tracks(tracks.model, world_T_cam, tracks.point, tracks.pixel, tracks.n_points).position


def first_inverse_depths(tracks: KeyframeTracks, pose: FloatArray, points: FloatArray) -> FloatArray:
    """Inverse depths (m,), 1/m, of the points in the keyframe that has each of them first; NaN without a point."""
    _, first = np.unique(tracks.point, return_index=True)
    cam_T_world = se3.inverse(pose @ tracks.imu_T_cam)[tracks.keyframe[first]]
    return np.asarray(1.0 / se3.transform(cam_T_world, points)[:, 2], dtype=np.float64)
