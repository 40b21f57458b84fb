"""A furnished room about the path: what a hand-held rig looks at."""

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from ..rig import Rig
from ..simulated_path import Path

_MARGIN = np.array([3.0, 3.0, 1.4])
"""m between the path and the walls, floor and ceiling"""


class Room:
    """A box with flat walls, and things that stand up to half way before them."""

    def __init__(self, path: Path, rig: Rig) -> None:
        self._path = path
        self._rig = rig
        self._body_T_cam = se3.inverse(rig.body_pose) @ rig.imu_T_cam
        positions = path.poses[:, :3, 3]
        self._low = positions.min(axis=0) - _MARGIN
        self._high = positions.max(axis=0) + _MARGIN

    def points(self, t: FloatArray, rng: np.random.Generator) -> FloatArray:
        """One point (n, 3) in the path's world, m, for each time (n,): where a pixel's ray meets wall or furniture."""
        camera = self._rig.camera
        u = rng.uniform(0.0, self._rig.width, len(t))
        v = rng.uniform(0.0, self._rig.height, len(t))
        ray = np.stack([(u - camera.cu) / camera.fu, (v - camera.cv) / camera.fv, np.ones(len(t))], axis=1)
        world_T_cam = self._path.at(t) @ self._body_T_cam
        eye = world_T_cam[:, :3, 3]
        direction = se3.transform(world_T_cam, ray) - eye
        direction = np.where(np.abs(direction) < 1e-9, 1e-9, direction)
        wall = np.where(direction > 0, (self._high - eye) / direction, (self._low - eye) / direction).min(axis=1)
        nearer = np.where(rng.random(len(t)) < 0.5, 1.0, rng.uniform(0.5, 1.0, len(t)))
        result: FloatArray = eye + (wall * nearer)[:, None] * direction
        return result
