"""The rectified stereo camera: pixel rows `[uL, vL, uR, vR]` of a point in the left camera's frame (equation 10).

The pair sees the homogeneous point q = (x, y, z, w), w being 1 for a point at a finite distance, at

    uL = fu x/z + cu,    uR = uL - fu b w/z,    v = fv y/z + cv,

with vL = vR = v. `StereoCamera.rows` and `row_derivatives` are these three rows and their derivatives; every prediction and
every Jacobian of the toolkit is made of them. Coordinates are the first axis: with stacks of small matrices what runs
over many observations takes several times as long.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .so3 import FloatArray

PIXEL_ROWS = (0, 2, 1, 2)
"""which of the three rows (uL, uR, v) predicts each of the printed four, uL, vL, uR, vR"""
MIN_DEPTH = 0.5
"""baselines: a nearer point is in both images only of cameras that see more than 90 degrees; at the camera's plane the
Jacobian is without bound"""


class StereoRows(NamedTuple):
    """Where a pair sees points; every array has its coordinate first, then the points (...)."""

    pixel: FloatArray
    """(3, ...) uL, uR and v, px"""
    slope: FloatArray
    """(3, ...) x/z, y/z and w/z (1/m)"""
    near: FloatArray
    """(...) 1/z, 1/m"""


@dataclass(frozen=True, slots=True)
class StereoCamera:
    """Intrinsics of a rectified stereo pair; z looks forward, x right, y down. Focal lengths and centre in pixels."""

    fu: float
    fv: float
    cu: float
    cv: float
    baseline: float
    """distance from the left to the right camera, m"""

    @property
    def min_depth(self) -> float:
        """m: a point nearer to the camera's plane than `MIN_DEPTH` baselines does not count as in front of it."""
        return MIN_DEPTH * self.baseline

    def rows(self, q: FloatArray) -> StereoRows:
        """The rows of points q (3, ...) in the left camera's frame in m, or of homogeneous ones (4, ...).

        Points behind the camera are projected by the same formula, as the report does; divides by zero at its plane.
        """
        near = 1.0 / q[2]
        slope = np.stack([q[0] * near, q[1] * near, near if len(q) == 3 else q[3] * near])
        pixel = np.empty_like(slope)
        pixel[0] = self.fu * slope[0] + self.cu
        pixel[1] = pixel[0] - (self.fu * self.baseline) * slope[2]
        pixel[2] = self.fv * slope[1] + self.cv
        return StereoRows(pixel, slope, near)

    def row_derivatives(self, seen: StereoRows, along: FloatArray) -> FloatArray:
        """Derivatives (3, k, ...) of the rows along k motions of the points, `along` (3 or 4, k, ...) in m.

        `along[i]` is how the coordinate i of q changes with each of the k parameters; a point at a finite distance has
        three coordinates, its w does not change.
        """
        x, y, w = seen.normalized
        left = (self.fu * seen.inverse_depth) * (along[0] - x * along[2])
        farther = -w * along[2] if len(along) == 3 else along[3] - w * along[2]
        right = left - (self.fu * self.baseline * seen.inverse_depth) * farther
        return np.stack([left, right, (self.fv * seen.inverse_depth) * (along[1] - y * along[2])])

    def project(self, points: ArrayLike) -> FloatArray:
        """Pixels (..., 4), uL, vL, uR, vR, of points (..., 3) in the left camera's frame, m (equation 10).

        Points behind the camera are projected by the same formula, as the report does; `points[..., 2] > 0` are those
        in front.
        """
        q = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        return np.ascontiguousarray(np.moveaxis(self.rows(q).pixel[list(PIXEL_ROWS)], 0, -1))

    def jacobian(self, points: ArrayLike) -> FloatArray:
        """Derivatives (..., 4, 3) of `project` with respect to points (..., 3): K_s dpi/dq in equations 11, 13."""
        q = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        identity = np.eye(3).reshape(3, 3, *([1] * (q.ndim - 1)))
        along = np.broadcast_to(identity, (3, 3, *q.shape[1:]))
        J = self.row_derivatives(self.rows(q), along)[list(PIXEL_ROWS)]
        return np.ascontiguousarray(np.moveaxis(J, (0, 1), (-2, -1)))

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
