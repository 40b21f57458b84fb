"""Moving objects: cars ahead, oncoming and crossing, or people in a room, each for a few seconds."""

import numpy as np

from fgbaseline.geometry import FloatArray

from ...observations import IntArray
from ..settings import WorldName
from ..simulated_path import Path

_SLOT = 4.0
"""s between the appearance of objects"""


class MovingObjects:
    """Moving object with constant velocity, shared by the points on its surface; one object at a time."""

    def __init__(self, path: Path, t: FloatArray, world: WorldName, rng: np.random.Generator) -> None:
        self._t = t
        slot = (t - t[0]) / _SLOT
        begin = t[0] + _SLOT * np.unique(np.append(np.floor(slot), np.ceil(slot[-1])))  # those that a frame is in
        poses, twists = path.at(begin), path.velocity_at(begin)
        n = len(begin)
        self._begin = begin
        self._axes = poses[:, :3, :3]
        if world == "room":
            local = np.stack([rng.uniform(1.2, 2.5, n), rng.uniform(-1.0, 1.0, n), rng.uniform(-0.8, 0.0, n)], axis=1)
            speed = rng.uniform(-0.6, 0.6, (n, 3)) * (0.3, 1.0, 0.1)
            self._size = np.array([0.15, 0.25, 0.8])
        else:
            kind = rng.choice(3, n, p=[0.5, 0.35, 0.15])
            ahead = np.stack([rng.uniform(12.0, 28.0, n), rng.uniform(-0.4, 0.4, n)], axis=1)
            oncoming = np.stack([rng.uniform(45.0, 80.0, n), rng.uniform(3.0, 3.6, n)], axis=1)
            crossing = np.stack([rng.uniform(18.0, 35.0, n), rng.uniform(8.0, 16.0, n)], axis=1)
            place = np.choose(kind[:, None], [ahead, oncoming, crossing])
            local = np.concatenate([place, np.zeros((n, 1))], axis=1)
            forward = np.choose(kind, [twists[:, 0] * rng.uniform(0.8, 1.2, n) + 1.0, -rng.uniform(6.0, 12.0, n), 0.0])
            sideways = np.where(kind == 2, -rng.uniform(4.0, 8.0, n), 0.0)
            speed = np.stack([forward, sideways, np.zeros(n)], axis=1)
            self._size = np.array([2.1, 0.9, 0.6])
        self._center = poses[:, :3, 3] + np.einsum("nij,nj->ni", self._axes, local)
        self._velocity = np.einsum("nij,nj->ni", self._axes, speed)

    def points(self, birth: IntArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Positions (n, 3), m, and velocities (n, 3), m/s, in the world of points at their frames of birth (n,)."""
        t = self._t[birth]
        slot = np.searchsorted(self._begin, t, side="right") - 1
        surface = rng.uniform(-1.0, 1.0, (len(birth), 3))
        face = rng.integers(0, 2, len(birth))
        surface[np.arange(len(birth)), face] = np.sign(surface[np.arange(len(birth)), face])
        offset = np.einsum("nij,nj->ni", self._axes[slot], surface * self._size)
        velocity = self._velocity[slot]
        return self._center[slot] + offset + velocity * (t - self._begin[slot])[:, None], velocity
