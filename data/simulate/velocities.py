"""Velocities recorded along a path."""

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from ..axis_conventions import axes_matrix
from .random_streams import RandomStream, generator
from .settings import Simulation
from .simulated_path import Path


def true_velocities(path: Path, t: FloatArray, settings: Simulation) -> FloatArray:
    """Body twists [v, w] (T, 6) in the axes of `imu_T_cam`: the samples a perfect sensor stamps with `t` (T,) s.

    They describe the motion at `t + time_offset`, of the interval that `velocity_of_interval` says.
    """
    at = t + settings.time_offset
    if settings.velocity_of_interval == "mean":
        return path.velocity_at(at)
    if settings.velocity_of_interval == "after":
        edges = np.concatenate([at, at[-1:] + (at[-1] - at[-2])])
    else:
        edges = np.concatenate([at[:1] - (at[1] - at[0]), at])
    return se3.log(se3.relative(path.at(edges))) / np.diff(edges)[:, None]


def recorded_velocities(path: Path, t: FloatArray, settings: Simulation) -> tuple[FloatArray, FloatArray]:
    """Linear (T, 3) m/s and angular (T, 3) rad/s velocity as recorded: scaled, in other axes, biased, noisy."""
    u = true_velocities(path, t, settings)
    noise = generator(settings.seed, RandomStream.VELOCITIES).standard_normal(u.shape)
    linear = settings.velocity_scale * u[:, :3] @ axes_matrix(settings.linear_axes)
    angular = u[:, 3:] @ axes_matrix(settings.angular_axes) + np.asarray(settings.gyro_bias)
    return linear + settings.sigma_linear * noise[:, :3], angular + settings.sigma_angular * noise[:, 3:]
