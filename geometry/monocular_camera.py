"""One rectified camera: pixels [uL, vL] of a point in its frame.

It observes the homogeneous point q = (x, y, z, w) at uL = fu x/z + cu, vL = fv y/z + cv, the rows of a stereo pair
without uR. An observation is written [uL, vL, NaN, NaN]. It does not depend on w, so depth comes from motion alone, and
scale from inertial samples.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .errors import FgbaselineError
from .so3 import FloatArray
from .stereo_camera import MIN_DEPTH, PredictedRows, StereoCamera

UNIT_LENGTH = 0.1
"""m; unit of the tolerances that are in baselines for a stereo pair: the baseline of a small stereo rig"""


@dataclass(frozen=True, slots=True)
class MonocularCamera:
    """Intrinsics of one camera, px; z points forward, x right, y down."""

    fu: float
    fv: float
    cu: float
    cv: float

    @property
    def K(self) -> FloatArray:  # noqa: N802
        """Camera matrix (3, 3)."""
        return np.array([[self.fu, 0.0, self.cu], [0.0, self.fv, self.cv], [0.0, 0.0, 1.0]])

    @property
    def unit_length(self) -> float:
        """Length (m) of which tolerances are multiples."""
        return UNIT_LENGTH

    @property
    def min_depth(self) -> float:
        """Smallest depth (m) of a point in front of the camera."""
        return MIN_DEPTH * UNIT_LENGTH

    def rows(self, q: FloatArray) -> PredictedRows:
        """Rows uL and v of points q (3, ...) or (4, ...) in the camera frame; see `StereoCamera.rows`."""
        inverse_z = 1.0 / q[2]
        x, y = q[0] * inverse_z, q[1] * inverse_z
        normalized = np.stack([x, y, inverse_z if len(q) == 3 else q[3] * inverse_z])
        return PredictedRows(np.stack([self.fu * x + self.cu, self.fv * y + self.cv]), normalized, inverse_z)

    def row_derivatives(self, predicted: PredictedRows, along: FloatArray) -> FloatArray:
        """Directional derivatives (2, k, ...) of the rows uL and v, px; see `StereoCamera.row_derivatives`."""
        x, y, _ = predicted.normalized
        du, dv = self.fu * predicted.inverse_z, self.fv * predicted.inverse_z
        return np.stack([du * (along[0] - x * along[2]), dv * (along[1] - y * along[2])])

    def project(self, points: ArrayLike) -> FloatArray:
        """Pixels uL, vL, NaN, NaN (..., 4) of points (..., 3) in the camera frame, m."""
        q = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        pixel = np.full((*q.shape[1:], 4), np.nan)
        pixel[..., :2] = np.moveaxis(self.rows(q).pixel, 0, -1)
        return pixel


Camera = StereoCamera | MonocularCamera


def left_of(camera: Camera) -> MonocularCamera:
    """Left camera of a stereo pair, alone."""
    return MonocularCamera(camera.fu, camera.fv, camera.cu, camera.cv)


def require_stereo(camera: Camera, what: str) -> StereoCamera:
    """The stereo camera `camera`. Raises FgbaselineError, naming the step `what`, for a single camera."""
    if isinstance(camera, StereoCamera):
        return camera
    raise FgbaselineError(f"{what} needs a stereo camera, and this recording has one camera")
