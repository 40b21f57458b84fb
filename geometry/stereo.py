"""The rectified stereo camera: pixel rows `[uL, vL, uR, vR]` of a point in the left camera's frame (equation 10)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .so3 import FloatArray


@dataclass(frozen=True, slots=True)
class StereoCamera:
    """Intrinsics of a rectified stereo pair; z looks forward, x right, y down. Focal lengths and centre in pixels."""

    fu: float
    fv: float
    cu: float
    cv: float
    baseline: float
    """distance from the left to the right camera, m"""

    def project(self, points: ArrayLike) -> FloatArray:
        """Pixels (..., 4) of points (..., 3) in the left camera's frame, m (equation 10).

        Points behind the camera are projected by the same formula, as the report does; `points[..., 2] > 0` tells
        which were in front.
        """
        p = np.asarray(points, dtype=np.float64)
        x, y, z = p[..., 0], p[..., 1], p[..., 2]
        uL = self.fu * x / z + self.cu
        v = self.fv * y / z + self.cv
        return np.stack([uL, v, uL - self.fu * self.baseline / z, v], axis=-1)

    def jacobian(self, points: ArrayLike) -> FloatArray:
        """Derivatives (..., 4, 3) of `project` with respect to points (..., 3): K_s dpi/dq in equations 11, 13."""
        p = np.asarray(points, dtype=np.float64)
        x, y, z = p[..., 0], p[..., 1], p[..., 2]
        J = np.zeros((*p.shape[:-1], 4, 3))
        J[..., 0, 0] = J[..., 2, 0] = self.fu / z
        J[..., 1, 1] = J[..., 3, 1] = self.fv / z
        J[..., 0, 2] = -self.fu * x / z**2
        J[..., 2, 2] = -self.fu * (x - self.baseline) / z**2
        J[..., 1, 2] = J[..., 3, 2] = -self.fv * y / z**2
        return J

    def triangulate(self, pixels: ArrayLike) -> FloatArray:
        """Points (..., 3) in the left camera's frame, m, of pixels (..., 4).

        Depth comes from uL - uR and height from vL, also where the disparity is not positive (the point then lies
        behind the camera, or at infinity for a disparity of zero: the caller decides whether that may take part).
        """
        z_pixels = np.asarray(pixels, dtype=np.float64)
        uL, vL = z_pixels[..., 0], z_pixels[..., 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            z = self.fu * self.baseline / (uL - z_pixels[..., 2])
            return np.stack([(uL - self.cu) / self.fu * z, (vL - self.cv) / self.fv * z, z], axis=-1)


def disparity(pixels: ArrayLike) -> FloatArray:
    """uL - uR (...,) in pixels of observations (..., 4)."""
    z = np.asarray(pixels, dtype=np.float64)
    result: FloatArray = z[..., 0] - z[..., 2]
    return result
