"""Linearization of an observation: predicted rows of world points, and their Jacobians w.r.t. pose and point.

Filters and structureless factors linearize here (`predict`), for a stereo pair and for one camera: the source paper's
equations 11 and 13 (docs/glossary.md). Odometry, windows and triangulation apply the chain rule to the rows of the
camera (`StereoCamera.row_derivatives`). GTSAM's factors linearize themselves (`smoother.graph.factors`).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import se3, so3
from .monocular_camera import Camera
from .so3 import FloatArray
from .stereo_camera import PredictedRows


@dataclass(frozen=True, eq=False)
class Prediction:
    """n world points as observed from one pose, in r rows each."""

    camera: Camera
    rows: PredictedRows
    cam_T_imu: FloatArray
    """(4, 4)"""
    imu_T_world: FloatArray
    """(4, 4)"""
    point_imu: FloatArray
    """(4, n) homogeneous points in the IMU frame"""

    @property
    def pixel(self) -> FloatArray:
        """Predicted rows (n, r), px: uL, uR and v, or uL and v."""
        return np.ascontiguousarray(self.rows.pixel.T)

    @property
    def depth(self) -> FloatArray:
        """Coordinates z (n,) of the homogeneous points in the left camera frame: depths in m where w = 1."""
        return np.asarray(1.0 / self.rows.inverse_z, dtype=np.float64)

    @property
    def cosine(self) -> FloatArray:
        """Cosines (n,) of the angle between optical axis and ray; not positive behind the camera."""
        x, y, _ = self.rows.normalized
        return np.asarray(np.copysign(1.0 / np.sqrt(x * x + y * y + 1.0), self.rows.inverse_z), dtype=np.float64)

    @cached_property
    def _by_camera_point(self) -> FloatArray:
        """Derivatives (rn, 4) w.r.t. the homogeneous point in the left camera frame, stacked row by row."""
        along = np.broadcast_to(np.eye(4)[:, :, None], (4, 4, self.rows.inverse_z.size))
        return np.ascontiguousarray(self.camera.row_derivatives(self.rows, along).transpose(2, 0, 1)).reshape(-1, 4)

    def pose_jacobian(self) -> FloatArray:
        """Jacobian (n, r, 6) w.r.t. the right perturbation [v, w] of world_T_imu, px/m and px/rad (H in equation 13).

        T exp(delta) moves the point s in the IMU frame by -hat(delta) s = [-s4 I, hat(s)] delta.
        """
        s, r = self.point_imu, len(self.rows.pixel)
        # One large matrix product is faster than n small ones.
        J = (self._by_camera_point[:, :3] @ self.cam_T_imu[:3, :3]).reshape(-1, r, 3)
        H = np.empty((len(J), r, 6))
        H[:, :, :3] = -s[3, :, None, None] * J
        np.matmul(J, so3.hat3(s[:3].T), out=H[:, :, 3:])
        return H

    def point_jacobian(self) -> FloatArray:
        """Jacobian (n, r, 4) w.r.t. the homogeneous world point."""
        r = len(self.rows.pixel)
        return np.asarray(self._by_camera_point @ (self.cam_T_imu @ self.imu_T_world)).reshape(-1, r, 4)


def predict(camera: Camera, cam_T_imu: FloatArray, world_T_imu: FloatArray, points: FloatArray) -> Prediction:
    """Predicts the observations of world points, (n, 3) in m or homogeneous (n, 4), from a pose world_T_imu."""
    imu_T_world = se3.inverse(world_T_imu)
    if points.shape[1] == 3:  # subtracting first avoids cancellation far from the origin
        s = np.ones((4, len(points)))
        s[:3] = imu_T_world[:3, :3] @ (points - world_T_imu[:3, 3]).T
    else:
        s = imu_T_world @ points.T
    return Prediction(camera, camera.rows(cam_T_imu @ s), cam_T_imu, imu_T_world, s)
