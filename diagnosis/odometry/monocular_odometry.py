"""Odometry of one camera: rotations between frames, and the direction of motion; lengths stay unknown."""

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray

from ..tracks.track_segments import TrackSegments, repeated
from .epipolar_motion import RayMatches, epipolar_motions
from .stereo_odometry import Odometry


def monocular_odometry(sequence: Sequence) -> Odometry:
    """Rotations of all intervals with enough tracks; translations and points are NaN."""
    before, after = track_pairs(sequence, 1)
    o, n = sequence.observations, sequence.n_frames - 1
    copied = repeated(sequence)[o.frame[before]]
    before, after = before[~copied], after[~copied]
    found = epipolar_motions(ray_matches(sequence, before, after), n)
    motion, covariance = np.full((n, 4, 4), np.nan), np.full((n, 6, 6), np.nan)
    motion[found.known] = np.eye(4)
    motion[found.known, :3, 3] = np.nan
    motion[found.known, :3, :3] = found.motion.rotation[found.known]
    covariance[:, 3:, 3:] = found.covariance[:, :3, :3]
    segments = TrackSegments(
        before=before,
        after=after,
        frame=o.frame[before],
        point=np.full((len(before), 3), np.nan),
        pixel=o.pixel[after][:, [0, 2, 1]],
    )
    return Odometry(found.known, motion, covariance, segments, found.whitened_squared, found.sigma * sequence.camera.fu)


def track_pairs(sequence: Sequence, step: int) -> tuple[IntArray, IntArray]:
    """Indices (n,) of observations and (n,) of those of the same landmark `step` frames later, sorted by frame."""
    o = sequence.observations
    key = o.landmark * np.int64(sequence.n_frames + step) + o.frame
    order = np.argsort(key)
    place = np.searchsorted(key, key + step, sorter=order)
    after = order[np.minimum(place, len(order) - 1)] if len(order) else order
    before = np.flatnonzero((o.landmark[after] == o.landmark) & (o.frame[after] == o.frame + step))
    before = before[np.argsort(o.frame[before], kind="stable")]
    return before, after[before]


def rays(sequence: Sequence) -> FloatArray:
    """Unit rays (n, 3) of the observations in the axes of the IMU."""
    camera, pixel = sequence.camera, sequence.observations.pixel
    ray = np.ones((len(pixel), 3))
    ray[:, :2] = (pixel[:, :2] - [camera.cu, camera.cv]) / [camera.fu, camera.fv]
    ray = ray @ sequence.imu_T_cam[:3, :3].T
    return np.asarray(ray / np.linalg.norm(ray, axis=1, keepdims=True))


def ray_matches(sequence: Sequence, before: IntArray, after: IntArray) -> RayMatches:
    """Pairs of observations as rays, by the frame of the first."""
    ray = rays(sequence)
    return RayMatches(sequence.observations.frame[before], ray[before], ray[after])
