"""The measurement model of a stereo observation: rows, noise, whitening and robust weight, one for all estimators.

The report measures z = [uL, vL, uR, vR] with variance V each. A rectified pair predicts vL = vR = v, so that the rows
(uL, uR, (vL + vR) / 2) with variances (V, V, V/2) have the same likelihood: their sum of whitened squares is less by
(vL - vR)^2 / (2 V), which no state changes. Filters, smoother, triangulation, diagnosis and comparison take the three
rows; the four are used only where the report's equations are followed as printed, and there is no kernel then. A kernel
is a function of the norm of the three rows, whitened by the covariance that the residual has: V in the smoother, in
triangulation and in the diagnosis, the innovation covariance H Sigma H^T + V in a filter.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from . import se3, so3
from .so3 import FloatArray
from .stereo import PIXEL_ROWS, StereoCamera, StereoRows

ROWS = ("uL", "uR", "v")
ROW_VARIANCE = np.array([1.0, 1.0, 0.5])
"""of (uL, uR, v), as a share of the variance V of one of the four rows"""
WHITE_SCALE = 1.0 / np.sqrt(ROW_VARIANCE)
"""by which residuals of (uL, uR, v) are multiplied so that all have the variance V"""


def measured_rows(pixel: FloatArray) -> FloatArray:
    """(..., 3) uL, uR, (vL + vR) / 2 of pixels, or of residuals, uL, vL, uR, vR (..., 4)."""
    v = 0.5 * (pixel[..., 1] + pixel[..., 3])
    return np.stack([pixel[..., 0], pixel[..., 2], v], axis=-1)


def squared_norm(residual: FloatArray, covariance: FloatArray) -> FloatArray:
    """(n,) r^T C^-1 r of residuals (n, 3) with covariances (n, 3, 3), px^2: chi-square with 3 degrees of freedom."""
    # C = L D L^T written out: a third of the time of LAPACK, which is called for each.
    a, b, c = covariance[:, 0].T
    d, e, f = covariance[:, 1, 1], covariance[:, 1, 2], covariance[:, 2, 2]
    x, y, z = residual.T
    by_a, to_e = b / a, e - c * b / a
    d1, y1 = d - by_a * b, y - by_a * x
    by_c, by_e = c / a, to_e / d1
    d2, y2 = f - by_c * c - by_e * to_e, z - by_c * x - by_e * y1
    norm: FloatArray = x * x / a + y1 * y1 / d1 + y2 * y2 / d2
    return norm


@dataclass(frozen=True, slots=True)
class HuberKernel:
    """Huber's loss on the whitened norm of an observation's three rows: quadratic up to `threshold` sigmas."""

    threshold: float = 2.5

    def weight(self, squared: FloatArray) -> FloatArray:
        """k / max(norm, k) of squared whitened norms (...): the factor on the inverse of the noise."""
        return np.asarray(self.threshold / np.maximum(np.sqrt(squared), self.threshold), dtype=np.float64)

    def weighted(self, squared: FloatArray) -> FloatArray:
        """Squared whitened norms (...) times their weight; infinite where they are."""
        return np.minimum(squared, self.threshold * np.sqrt(squared))

    def loss(self, squared: FloatArray) -> FloatArray:
        """Twice Huber's loss of squared whitened norms (...): the square up to k^2, then 2 k norm - k^2."""
        k = self.threshold
        return np.where(squared > k**2, 2.0 * k * np.sqrt(squared) - k**2, squared)

    def curvature_correction(self, squared: FloatArray) -> FloatArray:
        """c of squared whitened norms (...): half the loss has the second derivative w J^T J - c (w J^T r)(w J^T r)^T.

        w is the weight, J is taken as constant: 1 / (k norm) beyond k, 0 up to it.
        """
        k = self.threshold
        return np.where(squared > k**2, 1.0 / (k * np.sqrt(np.maximum(squared, k**2))), 0.0)


@dataclass(frozen=True, slots=True)
class StereoMeasurement:
    """What one observation of a problem says, and how much."""

    camera: StereoCamera
    variance: float
    """px^2, V: of each of uL, vL, uR, vR"""
    kernel: HuberKernel | None = None

    @property
    def row_variance(self) -> FloatArray:
        """(3,) px^2, of uL, uR and v."""
        return self.variance * ROW_VARIANCE

    @property
    def white_scale(self) -> FloatArray:
        """(3,) 1/px: what residuals of uL, uR and v are multiplied by to be whitened."""
        return np.asarray(WHITE_SCALE / np.sqrt(self.variance), dtype=np.float64)

    def whitened(self, residual: FloatArray) -> FloatArray:
        """(..., 3) residuals of the three rows in sigmas, of residuals of the four (..., 4), px."""
        return np.asarray(measured_rows(residual) * self.white_scale, dtype=np.float64)

    def weight(self, squared: FloatArray) -> FloatArray:
        """The kernel's weights of squared whitened norms (...); 1 without a kernel."""
        return np.ones_like(squared) if self.kernel is None else self.kernel.weight(squared)

    def weighted(self, squared: FloatArray) -> FloatArray:
        """Squared whitened norms (...) times the kernel's weight."""
        return squared if self.kernel is None else self.kernel.weighted(squared)

    def loss(self, squared: FloatArray) -> FloatArray:
        """The kernel's loss of squared whitened norms (...): these themselves without a kernel."""
        return squared if self.kernel is None else self.kernel.loss(squared)

    def curvature_correction(self, squared: FloatArray) -> FloatArray:
        """The kernel's `HuberKernel.curvature_correction`; 0 without a kernel."""
        return np.zeros_like(squared) if self.kernel is None else self.kernel.curvature_correction(squared)

    def documented_innovation(self, pixel: FloatArray, predicted: FloatArray) -> "DocumentedInnovation":
        """What the report's filter takes from pixels (n, 4) predicted at rows (n, 3): the four rows as printed, or the
        three where a kernel asks for their norm."""
        if self.kernel is None:
            rows = list(PIXEL_ROWS)
            return DocumentedInnovation(pixel - predicted[:, rows], rows, np.full(4, self.variance))
        return DocumentedInnovation(measured_rows(pixel) - predicted, [0, 1, 2], self.row_variance)

    def with_variance(self, variance: float) -> "StereoMeasurement":
        """The same model with another V, px^2."""
        return replace(self, variance=variance)


class DocumentedInnovation(NamedTuple):
    """n observations in r rows each, four or three."""

    residual: FloatArray
    """(n, r) measured minus predicted, px"""
    rows: list[int]
    """(r,) which of uL, uR and v predicts each"""
    variance: FloatArray
    """(r,) px^2"""


@dataclass(frozen=True, eq=False)
class Prediction:
    """n world points as a pair sees them from one pose."""

    camera: StereoCamera
    rows: StereoRows
    cam_T_imu: FloatArray
    """(4, 4)"""
    imu_T_world: FloatArray
    """(4, 4)"""
    point_imu: FloatArray
    """(4, n) the points in the IMU's frame"""

    @property
    def pixel(self) -> FloatArray:
        """(n, 3) uL, uR and v, px."""
        return np.ascontiguousarray(self.rows.pixel.T)

    @property
    def depth(self) -> FloatArray:
        """(n,) z in m, of points at a finite distance."""
        return np.asarray(1.0 / self.rows.inverse_depth, dtype=np.float64)

    @property
    def cosine(self) -> FloatArray:
        """(n,) of the angle between the optical axis and the ray to the point; not positive behind the camera."""
        x, y, _ = self.rows.normalized
        return np.asarray(np.copysign(1.0 / np.sqrt(x * x + y * y + 1.0), self.rows.inverse_depth), dtype=np.float64)

    @cached_property
    def _by_camera_point(self) -> FloatArray:
        """(3n, 4) derivatives by the homogeneous point in the left camera's frame, one row after the other."""
        along = np.broadcast_to(np.eye(4)[:, :, None], (4, 4, self.rows.inverse_depth.size))
        return np.ascontiguousarray(self.camera.row_derivatives(self.rows, along).transpose(2, 0, 1)).reshape(-1, 4)

    def pose_jacobian(self) -> FloatArray:
        """(n, 3, 6) derivatives by the right perturbation [v, w] of world_T_imu: H of equation 13.

        T exp(delta) moves the point s in the IMU's frame by -hat(delta) s = [-s4 I, hat(s)] delta.
        """
        s = self.point_imu
        # One product of matrices is faster than n small ones.
        J = (self._by_camera_point[:, :3] @ self.cam_T_imu[:3, :3]).reshape(-1, 3, 3)
        H = np.empty((len(J), 3, 6))
        H[:, :, :3] = -s[3, :, None, None] * J
        np.matmul(J, so3.hat3(s[:3].T), out=H[:, :, 3:])
        return H

    def point_jacobian(self) -> FloatArray:
        """(n, 3, 4) derivatives by the homogeneous world point."""
        return np.asarray(self._by_camera_point @ (self.cam_T_imu @ self.imu_T_world)).reshape(-1, 3, 4)


def predict(camera: StereoCamera, cam_T_imu: FloatArray, world_T_imu: FloatArray, points: FloatArray) -> Prediction:
    """How world points, (n, 3) in m or homogeneous (n, 4), are rows from a pose (4, 4)."""
    imu_T_world = se3.inverse(world_T_imu)
    if points.shape[1] == 3:  # the difference first: far from the origin it keeps the digits that sums would lose
        s = np.ones((4, len(points)))
        s[:3] = imu_T_world[:3, :3] @ (points - world_T_imu[:3, 3]).T
    else:
        s = imu_T_world @ points.T
    return Prediction(camera, camera.rows(cam_T_imu @ s), cam_T_imu, imu_T_world, s)


def back_projected(camera: StereoCamera, rows: FloatArray) -> FloatArray:
    """Homogeneous points (n, 4) in the left camera's frame, [x/z, y/z, 1, 1/z], of rows (n, 3): exact at infinity."""
    points = np.ones((len(rows), 4))
    points[:, 0] = (rows[:, 0] - camera.cu) / camera.fu
    points[:, 1] = (rows[:, 2] - camera.cv) / camera.fv
    points[:, 3] = (rows[:, 0] - rows[:, 1]) / (camera.fu * camera.baseline)
    return points
