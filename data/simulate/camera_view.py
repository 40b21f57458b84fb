"""Simulated camera view: projection of points, and their visibility in both cameras."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from ..observations import BoolArray, IntArray
from .rig import Rig

_CHUNK = 200_000


@dataclass(frozen=True, eq=False, slots=True)
class CameraView:
    """View of a stereo rig along a path: `cam_T_world` (T, 4, 4)."""

    rig: Rig
    cam_T_world: FloatArray
    nearest: float
    """m, the least depth that is tracked"""
    border: float
    """px, how far inside both images a point must lie"""
    seeing: BoolArray
    """(T,) false in a blackout"""

    def project(self, frame: IntArray, points: FloatArray) -> FloatArray:
        """Pixels (n, 4) without noise of points (n, 3) in the world, seen from frames (n,)."""
        return self.rig.camera.project(self._in_camera(frame, points))

    def visible(self, frame: IntArray, points: FloatArray, farthest: float = np.inf) -> BoolArray:
        """Mask (n,) of points (n, 3) visible in both cameras at frames (n,); NaN points are not."""
        seen = np.empty(len(frame), dtype=np.bool_)
        for start in range(0, len(frame), _CHUNK):
            part = slice(start, start + _CHUNK)
            p = self._in_camera(frame[part], points[part])
            depth = p[:, 2]
            with np.errstate(divide="ignore", invalid="ignore"):
                pixel = self.rig.camera.project(p)
                inside = (
                    (pixel[:, 2] >= self.border)
                    & (pixel[:, 0] >= self.border)
                    & (pixel[:, 0] <= self.rig.width - 1 - self.border)
                    & (pixel[:, 2] <= self.rig.width - 1 - self.border)
                    & (pixel[:, 1] >= self.border)
                    & (pixel[:, 1] <= self.rig.height - 1 - self.border)
                )
                seen[part] = inside & (depth >= self.nearest) & (depth <= farthest) & self.seeing[frame[part]]
        return seen

    def _in_camera(self, frame: IntArray, points: FloatArray) -> FloatArray:
        return se3.transform(self.cam_T_world[frame], points)
