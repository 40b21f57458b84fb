"""Measurement model of an observation by a stereo pair or one camera, shared by all estimators.

It defines the rows of an observation, their variances, their whitening and the Huber kernel.

The source paper (docs/glossary.md) measures z = [uL, vL, uR, vR] with variance V each. A rectified pair predicts
vL = vR = v. The rows (uL, uR, (vL + vR) / 2) with variances (V, V, V/2) therefore have the same likelihood up to a
constant: the sum of squared whitened residuals of the four components is larger by (vL - vR)^2 / (2 V), which does not
depend on the state. One camera has the rows (uL, vL) with variances (V, V).

Likelihoods and costs use these rows. Two places use the four components: the filter of the source paper without a
kernel, and reprojection errors in px. A kernel is a function of the whitened norm of the rows. Smoothers, triangulation
and diagnosis whiten by the noise covariance, R = diag(V, V, V/2); filters whiten by the covariance of the innovation,
H Sigma H^T + R. GTSAM's factors take rows and variances from here; their prediction and Jacobians are GTSAM's.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .monocular_camera import Camera, MonocularCamera
from .so3 import FloatArray
from .stereo_camera import PIXEL_ROWS, StereoCamera

STEREO_ROWS = ("uL", "uR", "v")
"""components of the measurement vector of a rectified pair, in this order"""
MONOCULAR_ROWS = ("uL", "v")
ROW_VARIANCE = np.array([1.0, 1.0, 0.5])
"""variances of (uL, uR, v), relative to the variance V of each of uL, vL, uR, vR"""
EQUALIZING_SCALE = 1.0 / np.sqrt(ROW_VARIANCE)
"""factors that give residuals of (uL, uR, v) the variance V"""


def three_rows(pixel: FloatArray) -> FloatArray:
    """Rows uL, uR, (vL + vR) / 2 (..., 3) of pixels or residuals uL, vL, uR, vR (..., 4)."""
    v = 0.5 * (pixel[..., 1] + pixel[..., 3])
    return np.stack([pixel[..., 0], pixel[..., 2], v], axis=-1)


def mahalanobis_squared(residual: FloatArray, covariance: FloatArray) -> FloatArray:
    """Squared Mahalanobis norms r^T C^-1 r (n,) of residuals (n, r), px, with covariances (n, r, r), px^2.

    r is 3, or 2 for one camera.
    """
    if residual.shape[1] == 2:
        a, b = covariance[:, 0].T
        x, y = residual.T
        d1, y1 = covariance[:, 1, 1] - b / a * b, y - b / a * x
        return np.asarray(x * x / a + y1**2 / d1, dtype=np.float64)
    # C = L D L^T written out takes a third of the time of numpy, which calls LAPACK once per matrix.
    a, b, c = covariance[:, 0].T
    d, e, f = covariance[:, 1, 1], covariance[:, 1, 2], covariance[:, 2, 2]
    x, y, z = residual.T
    l21, e1 = b / a, e - c * b / a
    d1, y1 = d - l21 * b, y - l21 * x
    l31, l32 = c / a, e1 / d1
    d2, y2 = f - l31 * c - l32 * e1, z - l31 * x - l32 * y1
    return np.asarray(x * x / a + y1 * y1 / d1 + y2 * y2 / d2, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class HuberKernel:
    """Huber loss on the whitened norm of an observation's rows: quadratic up to `threshold` sigmas."""

    threshold: float = 2.5
    """sigmas"""

    def weight(self, squared: FloatArray) -> FloatArray:
        """Weights k / max(norm, k) of squared whitened norms (...), k the threshold: factors on R^-1."""
        return np.asarray(self.threshold / np.maximum(np.sqrt(squared), self.threshold), dtype=np.float64)

    def weighted(self, squared: FloatArray) -> FloatArray:
        """Squared whitened norms (...) times their weight; infinite where the norms are infinite."""
        return np.minimum(squared, self.threshold * np.sqrt(squared))

    def loss(self, squared: FloatArray) -> FloatArray:
        """Twice the Huber loss of squared whitened norms (...): the square up to k^2, then 2 k norm - k^2."""
        k = self.threshold
        return np.where(squared > k**2, 2.0 * k * np.sqrt(squared) - k**2, squared)

    def terms(self, squared: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """`loss`, `weight` and `curvature_correction` of squared whitened norms (...), from one square root."""
        k = self.threshold
        norm = np.sqrt(squared)
        beyond, weight = norm > k, k / np.maximum(norm, k)
        loss = np.where(beyond, 2.0 * k * norm - k**2, squared)
        return loss, weight, np.where(beyond, weight / k**2, 0.0)

    def curvature_correction(self, squared: FloatArray) -> FloatArray:
        """Second-order coefficient c of squared whitened norms (...): 1 / (k norm) beyond k, 0 up to it.

        With whitened r and constant J, half the `loss` has the Hessian w J^T J - c (w J^T r)(w J^T r)^T, w the weight.
        """
        k = self.threshold
        return np.where(squared > k**2, 1.0 / (k * np.sqrt(np.maximum(squared, k**2))), 0.0)


@dataclass(frozen=True, slots=True)
class MeasurementModel:
    """Measurement model of a stereo pair or one camera: intrinsics, noise and robust kernel."""

    camera: Camera
    variance: float
    """px^2, variance V of each of uL, vL, uR, vR"""
    kernel: HuberKernel | None = None

    @property
    def monocular(self) -> bool:
        """Whether there is one camera, with the rows uL and vL."""
        return isinstance(self.camera, MonocularCamera)

    @property
    def n_rows(self) -> int:
        """Number r of rows of an observation, its degrees of freedom: 3, or 2 for one camera."""
        return len(MONOCULAR_ROWS if self.monocular else STEREO_ROWS)

    @property
    def row_variance(self) -> FloatArray:
        """Variances (r,) of the rows, px^2."""
        return np.full(len(MONOCULAR_ROWS), self.variance) if self.monocular else self.variance * ROW_VARIANCE

    @property
    def whitening_scale(self) -> FloatArray:
        """Factors (r,) that whiten residuals of the rows, 1/px."""
        scale = np.ones(len(MONOCULAR_ROWS)) if self.monocular else EQUALIZING_SCALE
        return np.asarray(scale / np.sqrt(self.variance), dtype=np.float64)

    def rows_of(self, pixel: FloatArray) -> FloatArray:
        """Rows (..., r) of pixels or residuals uL, vL, uR, vR (..., 4)."""
        return pixel[..., :2] if self.monocular else three_rows(pixel)

    def reprojection_error(self, residual: FloatArray) -> FloatArray:
        """Euclidean norms (n,), px, of residuals (n, 4): over uL, vL, uR, vR, or uL, vL for one camera."""
        return np.asarray(np.linalg.norm(residual[:, :2] if self.monocular else residual, axis=1))

    def whitened(self, residual: FloatArray) -> FloatArray:
        """Whitened residuals (..., r) of the rows, in sigmas, from residuals of uL, vL, uR, vR (..., 4), px."""
        return np.asarray(self.rows_of(residual) * self.whitening_scale, dtype=np.float64)

    def weight(self, squared: FloatArray) -> FloatArray:
        """Kernel weights of squared whitened norms (...); 1 without a kernel."""
        return np.ones_like(squared) if self.kernel is None else self.kernel.weight(squared)

    def weight_at(self, world_T_cam: FloatArray, points: FloatArray, pixel: FloatArray) -> FloatArray:
        """Kernel weights (n,) of pixels (n, 4) of world points (n, 3), seen from cameras at poses (n, 4, 4) or (4, 4).

        1 for points behind their camera, where a factor has no gradient.
        """
        R, p = world_T_cam[..., :3, :3], world_T_cam[..., :3, 3]
        q = np.einsum("...ji,...j->i...", R, points - p)
        with np.errstate(divide="ignore", invalid="ignore"):  # at the camera's plane
            residual = (self.rows_of(pixel).T - self.camera.rows(q).pixel) * self.whitening_scale[:, None]
            squared = np.einsum("in,in->n", residual, residual)
        return np.where(q[2] > self.camera.min_depth, self.weight(squared), 1.0)

    def weighted(self, squared: FloatArray) -> FloatArray:
        """Squared whitened norms (...) times the kernel weight."""
        return squared if self.kernel is None else self.kernel.weighted(squared)

    def loss(self, squared: FloatArray) -> FloatArray:
        """Twice the kernel's loss of squared whitened norms (...); the squared norms without a kernel."""
        return squared if self.kernel is None else self.kernel.loss(squared)

    def curvature_correction(self, squared: FloatArray) -> FloatArray:
        """Second-order coefficients (...), see `HuberKernel.curvature_correction`; 0 without a kernel."""
        return np.zeros_like(squared) if self.kernel is None else self.kernel.curvature_correction(squared)

    def robust_terms(self, squared: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """`loss`, `weight` and `curvature_correction` of squared whitened norms (...)."""
        if self.kernel is None:
            return squared, np.ones_like(squared), np.zeros_like(squared)
        return self.kernel.terms(squared)

    def documented_innovation(self, pixel: FloatArray, predicted: FloatArray) -> "DocumentedInnovation":
        """Innovation of the source paper's filter: pixels uL, vL, uR, vR (n, 4) minus predicted rows (n, 3), px.

        Without a kernel it has the four components of the paper; with a kernel, the three rows that the kernel weights.
        """
        if self.kernel is None:
            rows = list(PIXEL_ROWS)
            return DocumentedInnovation(pixel - predicted[:, rows], rows, np.full(4, self.variance))
        return DocumentedInnovation(three_rows(pixel) - predicted, [0, 1, 2], self.row_variance)

    def with_variance(self, variance: float) -> "MeasurementModel":
        """Model with another variance V, px^2."""
        return replace(self, variance=variance)


class DocumentedInnovation(NamedTuple):
    """Innovation of n stereo observations with r rows each: 4, or 3 with a kernel."""

    residual: FloatArray
    """(n, r) measured minus predicted, px"""
    rows: list[int]
    """(r,) index of the predicted row, in (uL, uR, v), that belongs to each row of the innovation"""
    variance: FloatArray
    """(r,) px^2"""


def back_projected(camera: Camera, rows: FloatArray, inverse_depth: float = np.nan) -> FloatArray:
    """Homogeneous points (n, 4) [x/z, y/z, 1, 1/z] in the left camera frame from rows (n, r); exact at infinity.

    A stereo pair measures 1/z; for one camera `inverse_depth`, 1/m, takes its place.
    """
    points = np.ones((len(rows), 4))
    points[:, 0] = (rows[:, 0] - camera.cu) / camera.fu
    points[:, 1] = (rows[:, -1] - camera.cv) / camera.fv
    points[:, 3] = inverse_depth
    if isinstance(camera, StereoCamera):
        points[:, 3] = (rows[:, 0] - rows[:, 1]) / (camera.fu * camera.baseline)
    return points
