"""Raw inertial samples of a path: exact derivatives of a spline through its poses, with biases, walks and noise.

Positions are a quintic spline, rotations the cubic spline of rotation vectors of SciPy (`RotationSpline`). Both pass
through the poses of the path and have continuous accelerations and angular velocities.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation, RotationSpline

from fgbaseline.geometry import FloatArray

from ..axis_conventions import axes_matrix
from ..imu import ImuNoise, ImuSamples
from .random_streams import RandomStream, generator
from .settings import Simulation
from .simulated_path import Path

DEGREE = 5
RAMP = 4.0
"""s from standing still to the full speed of a path"""
TINY = 1e-9
"""density that stands for a simulated noise of zero, since no estimator can do without noise"""


class MotionSpline:
    """Smooth motion through the poses of a path."""

    def __init__(self, path: Path) -> None:
        self._position = make_interp_spline(path.t, path.poses[:, :3, 3], k=min(DEGREE, len(path.t) - 1))
        self._rotation = RotationSpline(path.t, Rotation.from_matrix(path.poses[:, :3, :3]))

    def poses(self, t: FloatArray) -> FloatArray:
        """Poses (n, 4, 4) at times (n,), s."""
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, :3] = self._rotation(t).as_matrix()
        poses[:, :3, 3] = self._position(t)
        return poses

    def velocity(self, t: FloatArray) -> FloatArray:
        """Velocities (n, 3) in the world, m/s."""
        return np.asarray(self._position(t, nu=1), dtype=np.float64)

    def acceleration(self, t: FloatArray) -> FloatArray:
        """Accelerations (n, 3) in the world, m/s^2."""
        return np.asarray(self._position(t, nu=2), dtype=np.float64)

    def angular_velocity(self, t: FloatArray) -> FloatArray:
        """Angular velocities (n, 3) in the body, rad/s."""
        return np.asarray(self._rotation(t, order=1), dtype=np.float64)


class InertialRecording(NamedTuple):
    """Samples of a path with their truth at the frames."""

    samples: ImuSamples
    velocity: FloatArray
    """(T, 3) m/s in the world"""
    gyroscope_bias: FloatArray
    """(T, 3) rad/s in recorded axes"""
    accelerometer_bias: FloatArray
    """(T, 3) m/s^2 in recorded axes"""


def standing_start(path: Path, seconds: float) -> Path:
    """The path of a body that stands still until `seconds` and takes `RAMP` seconds to reach the path's speed."""
    since = np.clip((path.t - seconds) / RAMP, 0.0, 1.0)
    # integral of the smooth step 6 s^5 - 15 s^4 + 10 s^3, whose first two derivatives vanish at both ends
    ramp = RAMP * (since**6 - 3.0 * since**5 + 2.5 * since**4)
    along = ramp + np.maximum(path.t - seconds - RAMP, 0.0)
    return Path.through(path.t, MotionSpline(path).poses(along))


def recorded_samples(path: Path, t: FloatArray, settings: Simulation) -> InertialRecording:
    """Samples over the frames (T,), s, of a path in a world whose z axis points up."""
    imu = settings.imu
    assert imu is not None
    spline = MotionSpline(path)
    at = t[0] + np.arange(int(np.ceil((t[-1] - t[0]) * imu.rate - 1e-6)) + 1) / imu.rate
    when = at + settings.time_offset
    R = spline.poses(when)[:, :3, :3]
    force = np.einsum("nji,nj->ni", R, spline.acceleration(when) + np.array([0.0, 0.0, imu.gravity]))
    biases = _biases(len(at), settings)
    noise = generator(settings.seed, RandomStream.IMU_NOISE).standard_normal((len(at), 6)) * np.sqrt(imu.rate)
    angular = spline.angular_velocity(when) @ axes_matrix(settings.angular_axes) + biases[:, :3]
    linear = settings.velocity_scale * force @ axes_matrix(settings.linear_axes) + biases[:, 3:]
    samples = ImuSamples(
        at,
        angular + imu.gyroscope_density * noise[:, :3],
        linear + imu.accelerometer_density * noise[:, 3:],
        ImuNoise(
            imu.gyroscope_density or TINY, imu.gyroscope_walk, imu.accelerometer_density or TINY, imu.accelerometer_walk
        ),
        imu.gravity,
    )
    at_frames = np.stack([np.interp(t, at, column) for column in biases.T], axis=1)
    return InertialRecording(samples, spline.velocity(t), at_frames[:, :3], at_frames[:, 3:])


def _biases(n: int, settings: Simulation) -> FloatArray:
    """Biases (n, 6) of gyroscope and accelerometer: random walks from their values at the first sample."""
    imu = settings.imu
    assert imu is not None
    steps = generator(settings.seed, RandomStream.IMU_BIAS).standard_normal((n, 6)) / np.sqrt(imu.rate)
    steps *= np.repeat([imu.gyroscope_walk, imu.accelerometer_walk], 3)
    steps[0] = [*settings.gyro_bias, *imu.accelerometer_bias]
    return np.cumsum(steps, axis=0)
