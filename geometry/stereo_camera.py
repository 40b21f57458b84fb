"""Rectified stereo camera: pixels [uL, vL, uR, vR] of a point in the left camera frame.

The equation numbers are those of the source paper (docs/glossary.md); this is equation 10.

The pair observes the homogeneous point q = (x, y, z, w), with w = 1 for a point at a finite distance, at

    uL = fu x/z + cu,    uR = uL - fu b w/z,    v = fv y/z + cv,

with vL = vR = v. `StereoCamera.rows` and `row_derivatives` give these three rows and their derivatives, from which all
predictions and Jacobians are built. Coordinates are the first axis, because stacks of small matrices are several times
slower over many observations.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .so3 import FloatArray

PIXEL_COMPONENTS = ("uL", "vL", "uR", "vR")
"""components of the pixels of an observation, in this order"""
PIXEL_ROWS = (0, 2, 1, 2)
"""index into (uL, uR, v) of the prediction of each of uL, vL, uR, vR"""
MIN_DEPTH = 0.5
"""Smallest depth in baselines. Nearer points are in both images only with more than 90 degrees of view, and at the
camera plane the Jacobian is unbounded."""


class PredictedRows(NamedTuple):
    """Predicted rows of points, with what their derivatives need; coordinates first, then the points (...).

    r is 3, or 2 for one camera.
    """

    pixel: FloatArray
    """(r, ...) uL, uR and v, or uL and v, px"""
    normalized: FloatArray
    """(3, ...) x/z, y/z and w/z, the inverse depth (1/m)"""
    inverse_z: FloatArray
    """(...) 1/z of the point as given: the inverse depth where w = 1"""


@dataclass(frozen=True, slots=True)
class StereoCamera:
    """Intrinsics of a rectified stereo pair, px; z points forward, x right, y down."""

    fu: float
    fv: float
    cu: float
    cv: float
    baseline: float
    """distance from the left to the right camera, m"""

    @property
    def K(self) -> FloatArray:  # noqa: N802
        """Camera matrix (3, 3)."""
        return np.array([[self.fu, 0.0, self.cu], [0.0, self.fv, self.cv], [0.0, 0.0, 1.0]])

    @property
    def unit_length(self) -> float:
        """Length (m) of which tolerances are multiples: the baseline."""
        return self.baseline

    @property
    def min_depth(self) -> float:
        """Smallest depth (m) of a point in front of the camera: `MIN_DEPTH` baselines."""
        return MIN_DEPTH * self.baseline

    def rows(self, q: FloatArray) -> PredictedRows:
        """Rows of points q (3, ...) in the left camera frame, m, or of homogeneous points (4, ...).

        Points behind the camera are projected by the same formula, as in the source paper. Divides by zero at z = 0.
        """
        inverse_z = 1.0 / q[2]
        normalized = np.empty((3, *np.shape(inverse_z)))
        np.multiply(q[:2], inverse_z, out=normalized[:2])
        normalized[2] = inverse_z if len(q) == 3 else q[3] * inverse_z
        pixel = np.empty_like(normalized)
        pixel[0] = self.fu * normalized[0] + self.cu
        pixel[1] = pixel[0] - (self.fu * self.baseline) * normalized[2]
        pixel[2] = self.fv * normalized[1] + self.cv
        return PredictedRows(pixel, normalized, inverse_z)

    def row_derivatives(self, predicted: PredictedRows, along: FloatArray) -> FloatArray:
        """Directional derivatives (3, k, ...) of the rows along k directions `along` (3 or 4, k, ...), m.

        `along[i]` is the derivative of coordinate i of q w.r.t. each of the k parameters. Three coordinates suffice for
        points at a finite distance, where w is constant.
        """
        x, y, w = predicted.normalized
        inverse_z = predicted.inverse_z
        # filled in place: the arrays are short, so that the number of calls is the cost
        result = np.empty((3, *along.shape[1:]))
        left, right, v = result
        np.subtract(along[0], np.multiply(x, along[2], out=left), out=left)
        left *= self.fu * inverse_z
        np.multiply(w, along[2], out=right)
        if len(along) == 4:
            right -= along[3]
        right *= self.fu * self.baseline * inverse_z
        right += left
        np.subtract(along[1], np.multiply(y, along[2], out=v), out=v)
        v *= self.fv * inverse_z
        return result

    def project(self, points: ArrayLike) -> FloatArray:
        """Pixels uL, vL, uR, vR (..., 4) of points (..., 3) in the left camera frame, m (equation 10).

        Points behind the camera (`points[..., 2] <= 0`) are projected by the same formula, as in the source paper.
        """
        q = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        return np.ascontiguousarray(np.moveaxis(self.rows(q).pixel[list(PIXEL_ROWS)], 0, -1))

    def jacobian(self, points: ArrayLike) -> FloatArray:
        """Jacobian (..., 4, 3) of `project` w.r.t. points (..., 3): K_s dpi/dq in equations 11 and 13.

        It is for user-written filters (docs/examples/my-filter.md); estimators use `linearization.predict`.
        """
        q = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        identity = np.eye(3).reshape(3, 3, *([1] * (q.ndim - 1)))
        along = np.broadcast_to(identity, (3, 3, *q.shape[1:]))
        J = self.row_derivatives(self.rows(q), along)[list(PIXEL_ROWS)]
        return np.ascontiguousarray(np.moveaxis(J, (0, 1), (-2, -1)))

    def triangulate(self, pixels: ArrayLike) -> FloatArray:
        """Triangulates pixels (..., 4) to points (..., 3) in the left camera frame, m; y is from vL, vR is not used.

        A disparity below zero gives a point behind the camera, one of zero a point at infinity; the caller decides
        whether to use them.
        """
        return self.triangulate_rows(np.asarray(pixels, dtype=np.float64)[..., [0, 2, 1]])

    def triangulate_rows(self, rows: FloatArray) -> FloatArray:
        """Triangulates rows uL, uR, v (..., 3), px, to points (..., 3) in the left camera frame, m."""
        uL, uR, v = np.moveaxis(rows, -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            z = self.fu * self.baseline / (uL - uR)
            return np.stack([(uL - self.cu) / self.fu * z, (v - self.cv) / self.fv * z, z], axis=-1)


def disparity(pixels: ArrayLike) -> FloatArray:
    """Disparities uL - uR (...,), px, of observations (..., 4)."""
    z = np.asarray(pixels, dtype=np.float64)
    result: FloatArray = z[..., 0] - z[..., 2]
    return result
