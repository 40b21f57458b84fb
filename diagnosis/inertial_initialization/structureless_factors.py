"""Tracks of a few keyframes as a term of least squares over their poses, the points eliminated."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel, se3
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.triangulation import triangulate_tracks

from ..odometry.stereo_odometry import Odometry
from ..tracks.track_segments import track_chains

MIN_OBSERVATIONS = 2
"""observations of a track among the keyframes"""
MIN_FRONT = 0.1
"""m, nearest depth of a point"""


@dataclass(frozen=True, eq=False, slots=True)
class KeyframeTracks:
    """n observations of m points in keyframes."""

    model: MeasurementModel
    imu_T_cam: FloatArray
    keyframe: IntArray
    """(n,) sorted"""
    point: IntArray
    """(n,) 0..m-1"""
    pixel: FloatArray
    """(n, 4)"""

    @property
    def n_points(self) -> int:
        """m."""
        return int(self.point.max(initial=-1)) + 1

    def normal_equations(self, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Information (6k, 6k) and gradient (6k,) of the right perturbations of k poses (k, 4, 4).

        The points are those that fit best with the poses held, so that only their elimination is left (variable
        projection, Golub and Pereyra 1973, in Kaufman's form).
        """
        k, m = len(pose), self.n_points
        H, g = np.zeros((k, 6, k, 6)), np.zeros((k, 6))
        if m == 0:
            return H.reshape(6 * k, 6 * k), g.ravel()
        world_T_cam = (pose @ self.imu_T_cam)[self.keyframe]
        points = triangulate_tracks(self.model, world_T_cam, self.point, self.pixel, m).position
        information, gradient, cross = np.zeros((m, 3, 3)), np.zeros((m, 3)), np.zeros((m, k, 6, 3))
        cam_T_imu, white = se3.inverse(self.imu_T_cam), self.model.whitening_scale
        bounds = np.searchsorted(self.keyframe, np.arange(k + 1))
        for i in range(k):
            at = slice(int(bounds[i]), int(bounds[i + 1]))
            own = self.point[at]
            seen = predict(self.model.camera, cam_T_imu, pose[i], points[own])
            residual = (self.model.rows_of(self.pixel[at]) - seen.pixel) * white
            front = np.isfinite(points[own]).all(axis=1) & (seen.depth > MIN_FRONT)
            weight = np.where(front, np.sqrt(self.model.weight((residual**2).sum(axis=1))), 0.0)
            scale = weight[:, None, None] * white[:, None]
            J, P = seen.pose_jacobian() * scale, seen.point_jacobian()[:, :, :3] * scale
            r = residual * weight[:, None]
            J[~front], P[~front], r[~front] = 0.0, 0.0, 0.0
            H[i, :, i] += np.einsum("nra,nrb->ab", J, J)
            g[i] += np.einsum("nra,nr->a", J, r)
            information[own] += np.swapaxes(P, 1, 2) @ P  # a point is at most once in a keyframe
            gradient[own] += np.einsum("nra,nr->na", P, r)
            cross[own, i] += np.swapaxes(J, 1, 2) @ P
        return _without_points(H, g, information, gradient, cross)


def _without_points(
    H: FloatArray, g: FloatArray, information: FloatArray, gradient: FloatArray, cross: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The Schur complement of the points that are determined."""
    k, m = len(g), len(gradient)
    determined = np.linalg.eigvalsh(information)[:, 0] > 1e-12 * np.trace(information, axis1=1, axis2=2)
    W = cross[determined].reshape(int(determined.sum()), 6 * k, 3)
    if m == 0 or not len(W):
        return H.reshape(6 * k, 6 * k), g.ravel()
    solved = np.linalg.solve(information[determined], np.swapaxes(W, 1, 2))
    H_reduced = H.reshape(6 * k, 6 * k) - np.einsum("mac,mcb->ab", W, solved)
    g_reduced = g.ravel() - np.einsum("mca,mc->a", solved, gradient[determined])
    return 0.5 * (H_reduced + H_reduced.T), g_reduced


def keyframe_tracks(sequence: Sequence, seen: Odometry, frames: IntArray, sigma: float) -> KeyframeTracks:
    """Tracks in the keyframes `frames` (k,), of segments that agree with the odometry; `sigma` px of each pixel row."""
    o = sequence.observations
    chain = track_chains(seen.segments.before, seen.segments.after, seen.inlier, o)
    place = np.full(sequence.n_frames, -1, dtype=np.int64)
    place[frames] = np.arange(len(frames))
    chosen = np.flatnonzero((place[o.frame] >= 0) & (chain >= 0))
    _, row, count = np.unique(chain[chosen], return_inverse=True, return_counts=True)
    chosen = chosen[count[row] >= MIN_OBSERVATIONS]
    point = np.unique(chain[chosen], return_inverse=True)[1].astype(np.int64)
    model = MeasurementModel(sequence.camera, sigma**2, HuberKernel())
    return KeyframeTracks(model, sequence.imu_T_cam, place[o.frame[chosen]], point, o.pixel[chosen])
