"""A scene seen from above."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Problem
from fgbaseline.geometry import FloatArray

STEEP = 0.2
"""horizontal part of a unit vector, below which it points nowhere in particular"""


@dataclass(frozen=True, eq=False, slots=True)
class TopView:
    """The horizontal plane: x ahead of the camera at the start, y to its left, both unit vectors (3,) in the world."""

    ahead: FloatArray
    left: FloatArray
    up: FloatArray

    @staticmethod
    def of(problem: Problem) -> "TopView":
        """The view down `Sequence.up`, ahead being the optical axis at frame 0 (the image's top, if that is steep)."""
        up = problem.sequence.up
        world_R_cam = problem.initial_pose[:3, :3] @ problem.sequence.imu_T_cam[:3, :3]
        axes = [world_R_cam[:, 2], -world_R_cam[:, 1], world_R_cam[:, 0]]
        level = [axis - (axis @ up) * up for axis in axes]
        ahead = next(axis for axis in level if np.linalg.norm(axis) > STEEP)
        ahead = ahead / np.linalg.norm(ahead)
        return TopView(ahead, np.cross(up, ahead), up)

    def plane(self, points: FloatArray) -> FloatArray:
        """(n, 2) m: points or directions (n, 3) of the world, seen from above."""
        return np.stack([points @ self.ahead, points @ self.left], axis=1)

    def height(self, points: FloatArray) -> FloatArray:
        """(n,) m above the start."""
        return np.asarray(points @ self.up, dtype=np.float64)
