"""Scene of a problem seen from above."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray

from .problem import Problem

STEEP = 0.2
"""horizontal part of a unit vector below which its heading is undefined"""


@dataclass(frozen=True, eq=False, slots=True)
class TopView:
    """Horizontal plane: x ahead of the camera at the start, y to its left, both unit vectors (3,) in the world."""

    ahead: FloatArray
    left: FloatArray
    up: FloatArray

    @staticmethod
    def of(problem: Problem) -> "TopView":
        """View down `Sequence.up` with the camera at frame 0."""
        return TopView.of_camera(problem.initial_pose @ problem.sequence.imu_T_cam, problem.sequence.up)

    @staticmethod
    def of_camera(world_T_cam: FloatArray, up: FloatArray) -> "TopView":
        """View down `up`, ahead being the optical axis of a camera pose (4, 4) (the image's top, if that is steep)."""
        world_R_cam = world_T_cam[:3, :3]
        axes = [world_R_cam[:, 2], -world_R_cam[:, 1], world_R_cam[:, 0]]
        level = [axis - (axis @ up) * up for axis in axes]
        ahead = next(axis for axis in level if np.linalg.norm(axis) > STEEP)
        ahead = ahead / np.linalg.norm(ahead)
        return TopView(ahead, np.cross(up, ahead), up)

    def plane(self, points: FloatArray) -> FloatArray:
        """Points or directions (n, 3) of the world as seen from above (n, 2), m."""
        return np.stack([points @ self.ahead, points @ self.left], axis=1)

    def height(self, points: FloatArray) -> FloatArray:
        """Heights (n,) above the start, m."""
        return np.asarray(points @ self.up, dtype=np.float64)

    def scene(self, points: FloatArray) -> FloatArray:
        """Coordinates (n, 3), m, ahead of, left of and above the start, of points (n, 3) of the world."""
        with np.errstate(invalid="ignore"):  # a landmark at infinity
            return np.column_stack([self.plane(points), self.height(points)])
