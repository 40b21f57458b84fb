"""Path of a body in continuous time: poses on a fine grid, joined by constant body velocities."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray, InputError, se3, so3

from ..imu import STANDARD_GRAVITY
from ..sequence import Sequence
from .settings import MAX_TIME_OFFSET, Simulation, Velocities

MAX_METERS = 1000.0
"""m a frame, on average over a drive: no point that a camera sees in one frame would be near in the next"""


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """Motion as a function of time; before its start and after its end velocities are constant."""

    t: FloatArray
    """(g,) s, rising; reaches beyond the first and last frame"""
    poses: FloatArray
    """(g, 4, 4) of the body in some world"""
    velocity: FloatArray
    """(g - 1, 6) the body twist [v, w] held from one grid time to the next"""

    @staticmethod
    def through(t: FloatArray, poses: FloatArray) -> "Path":
        """The path through poses (g, 4, 4) at times (g,)."""
        return Path(t, poses, se3.log(se3.relative(poses)) / np.diff(t)[:, None])

    def at(self, t: ArrayLike) -> FloatArray:
        """Poses (n, 4, 4) at times (n,) in s."""
        times = np.asarray(t, dtype=np.float64)
        i = np.clip(np.searchsorted(self.t, times, side="right") - 1, 0, len(self.velocity) - 1)
        poses: FloatArray = self.poses[i] @ se3.exp((times - self.t[i])[:, None] * self.velocity[i])
        return poses

    def velocity_at(self, t: ArrayLike, width: float = 0.02) -> FloatArray:
        """Body twists [v, w] (n, 6) at the instants (n,): central differences over `width` s."""
        times = np.asarray(t, dtype=np.float64)
        motion = se3.inverse(self.at(times - 0.5 * width)) @ self.at(times + 0.5 * width)
        return se3.log(motion) / width

    def moved(self, pose: FloatArray) -> "Path":
        """Path in another world, to which `pose` (4, 4) takes the present one."""
        return Path(self.t, pose @ self.poses, self.velocity)

    def of(self, mounted: FloatArray) -> "Path":
        """The path of something at the pose `mounted` (4, 4) on this body."""
        back = se3.adjoint(se3.inverse(mounted))
        return Path(self.t, self.poses @ mounted, self.velocity @ back.T)


def time_grid(seconds: float, frame_rate: float) -> FloatArray:
    """Times (g,) in s at 100 Hz or more, every frame's among them, with room for time offsets at both ends."""
    step = 1.0 / (frame_rate * np.ceil(100.0 / frame_rate))
    before = np.ceil((MAX_TIME_OFFSET + 2.0 / frame_rate) / step)
    after = np.ceil((seconds + MAX_TIME_OFFSET + 2.0 / frame_rate) / step)
    grid: FloatArray = np.arange(-before, after + 1) * step
    return grid


def handheld_path(t: FloatArray, rng: np.random.Generator) -> Path:
    """A rig waved about a room: every axis turns and shifts, in sines of 0.1 to 0.7 Hz (0.4 m/s, 0.4 rad/s RMS)."""
    frequency = rng.uniform(0.1, 0.7, (6, 5))
    phase = rng.uniform(0.0, 2.0 * np.pi, (6, 5))
    rate = rng.uniform(0.6, 1.0, (6, 5))
    rate *= 0.4 * np.sqrt(2.0) / np.linalg.norm(rate, axis=1, keepdims=True)
    amplitude = rate / (2.0 * np.pi * frequency)
    waves = (amplitude * np.sin(2.0 * np.pi * frequency * t[:, None, None] + phase)).sum(axis=2)
    poses = np.zeros((len(t), 4, 4))
    poses[:, :3, :3] = so3.exp_so3(waves[:, 3:])
    poses[:, :3, 3] = waves[:, :3]
    poses[:, 3, 3] = 1.0
    return Path.through(t, poses)


def drone_path(t: FloatArray, rng: np.random.Generator) -> Path:
    """A multirotor in a hall: sines of 0.05 to 0.25 Hz (1.5 m/s RMS), its z axis along the thrust, a slow heading."""
    frequency = rng.uniform(0.05, 0.25, (4, 4))
    phase = rng.uniform(0.0, 2.0 * np.pi, (4, 4))
    rate = rng.uniform(0.6, 1.0, (4, 4))
    rate *= np.array([[1.5], [1.5], [0.5], [0.3]]) * np.sqrt(2.0) / np.linalg.norm(rate, axis=1, keepdims=True)
    omega = 2.0 * np.pi * frequency
    angle = omega * t[:, None, None] + phase
    waves = (rate / omega * np.sin(angle)).sum(axis=2)
    acceleration = -(rate * omega * np.sin(angle)).sum(axis=2)[:, :3]
    up = acceleration + np.array([0.0, 0.0, STANDARD_GRAVITY])
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    ahead = np.stack([np.cos(waves[:, 3]), np.sin(waves[:, 3]), np.zeros(len(t))], axis=1)
    left = np.cross(up, ahead)
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, :3, :3] = np.stack([np.cross(left, up), left, up], axis=2)
    poses[:, :3, 3] = waves[:, :3]
    return Path.through(t, poses)


def followed(settings: Simulation) -> Velocities:
    """The velocities of `settings.along`, from time 0, without their stated bias, up to `duration`.

    Raises InputError where fewer than two frames or no finite, rising samples are left.
    """
    given = settings.along
    assert given is not None
    if isinstance(given, Sequence):
        given = Velocities(given.t, given.linear_velocity, given.angular_velocity)
    t = np.asarray(given.t, dtype=np.float64)
    linear = np.asarray(given.linear, dtype=np.float64)
    angular = np.asarray(given.angular, dtype=np.float64) - settings.along_gyro_bias
    if t.ndim != 1 or linear.shape != (len(t), 3) or angular.shape != (len(t), 3):
        raise InputError(
            f"along: expected T stamps and T x 3 velocities, got {t.shape}, {linear.shape} and {angular.shape}"
        )
    if not (np.isfinite(t).all() and np.isfinite(linear).all() and np.isfinite(angular).all()):
        raise InputError("along: its stamps and velocities must be finite")
    if np.any(np.diff(t) <= 0):
        raise InputError("along: its stamps must rise")
    t = t - t[:1]
    kept = t <= (np.inf if settings.duration is None else settings.duration)
    n = int(kept.sum())
    if n < 2:
        raise InputError(f"along: fewer than two of its frames lie within duration ({settings.duration!r} s)")
    with np.errstate(over="ignore"):
        speed, dt = np.linalg.norm(linear[kept], axis=1), np.diff(t[kept])
        path = float(speed[:-1] @ dt + (speed[0] + speed[-1]) * _reach(dt))
    if not path <= MAX_METERS * n:
        raise InputError(
            f"along: its velocities lead over {path:.3g} m in {n} frames, and at most {MAX_METERS:g} m a frame are "
            "simulated; check that its stamps are in s and its velocities in m/s"
        )
    return Velocities(t[kept], linear[kept], angular[kept])


def _reach(dt: FloatArray) -> float:
    """Duration, s, by which a path is continued beyond both ends of stamps with intervals `dt`."""
    return MAX_TIME_OFFSET + 2.0 * float(dt.max())


def path_along(velocities: Velocities) -> Path:
    """The path that integrating velocities gives (equation 9 without noise), each held until the next stamp."""
    velocity = np.concatenate([velocities.linear, velocities.angular], axis=1)
    reach = _reach(np.diff(velocities.t))
    t = np.concatenate([velocities.t[:1] - reach, velocities.t, velocities.t[-1:] + reach])
    held = np.concatenate([velocity[:1], velocity])
    increments = se3.exp(held * np.diff(t)[:, None])
    return Path(t, se3.compose(increments, start=se3.inverse(increments[0])), held)
