"""Raw inertial samples between the frames, and the start of an inertial problem."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, strapdown

from ..display import Displayed
from ..imu import ImuNoise, ImuSamples
from ..observations import IntArray
from .imu_gaps import interval_densities

LEAST_WALK = 1e-4
"""1/s, times the noise density: in place of a bias that does not walk, so that the covariance has an inverse"""
HELD_VARIANCE = 1e-9
"""share of the largest variance in a block of the start's covariance, up to which a variance is rounding"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class InertialStart(Displayed):
    """Velocity and biases at frame 0 with the covariance of the whole state; the pose is the problem's initial pose."""

    velocity: FloatArray
    """(3,) m/s, in world axes"""
    gyroscope_bias: FloatArray
    """(3,) rad/s"""
    accelerometer_bias: FloatArray
    """(3,) m/s^2"""
    covariance: FloatArray
    """(15, 15) of the error [translation, rotation, velocity, gyroscope bias, accelerometer bias]; position and heading
    have no variance, since they define the world"""
    source: str = "given"
    """method by which the start was estimated, one sentence"""

    @property
    def bias(self) -> FloatArray:
        """Biases (6,) of gyroscope, rad/s, and accelerometer, m/s^2."""
        return np.concatenate([self.gyroscope_bias, self.accelerometer_bias])

    @property
    def free_directions(self) -> FloatArray:
        """Orthonormal directions (15, r) of the error in which the covariance is not zero, block by block."""
        columns = []
        for i in range(0, strapdown.STATE, 3):
            variance, axes = np.linalg.eigh(self.covariance[i : i + 3, i : i + 3])
            kept = axes[:, (variance > 0.0) & (variance > HELD_VARIANCE * variance[-1])]
            column = np.zeros((strapdown.STATE, kept.shape[1]))
            column[i : i + 3] = kept
            columns.append(column)
        return np.concatenate(columns, axis=1)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ImuIntervals(Displayed):
    """Samples cut at the frames: P pieces of constant angular velocity and specific force, in order.

    A piece lies between neighboring instants of samples and frames and holds the mean of the two interpolated values,
    so its error is of second order in the length of a piece.
    """

    starts: IntArray
    """(T,): interval k, from frame k to k + 1, has the pieces from `starts[k]` up to `starts[k + 1]`"""
    dt: FloatArray
    """(P,) s"""
    angular_velocity: FloatArray
    """(P, 3) rad/s"""
    specific_force: FloatArray
    """(P, 3) m/s^2"""
    noise: ImuNoise
    gravity: float
    """magnitude, m/s^2"""
    densities: FloatArray
    """(T-1, 4) those of `noise`, for each interval; larger over gaps between samples"""

    def pieces(self, k: int) -> slice:
        """Pieces of the interval from frame k to k + 1."""
        return slice(int(self.starts[k]), int(self.starts[k + 1]))

    def motion(self, k: int, gyroscope_bias: FloatArray, accelerometer_bias: FloatArray) -> strapdown.PreintegratedImu:
        """Motion from frame k to k + 1 with the biases (3,) subtracted from the samples."""
        at = self.pieces(k)
        return strapdown.integrate(
            self.angular_velocity[at] - gyroscope_bias,
            self.specific_force[at] - accelerometer_bias,
            self.dt[at],
            self.densities[k],
        )

    @property
    def gravity_vector(self) -> FloatArray:
        """Gravity (3,), m/s^2, in the world, whose z axis points up."""
        return np.array([0.0, 0.0, -self.gravity])


def imu_intervals(samples: ImuSamples, frames: FloatArray) -> ImuIntervals:
    """Pieces of the samples between frames (T,), s.

    Before the first and after the last sample its value is held, for up to one sample period. Over a gap the
    values are interpolated, and the noise is that of `imu_gaps.interval_densities`. Raises InputError where a frame is
    farther outside the samples.
    """
    before, after, period = samples.t[0] - frames[0], frames[-1] - samples.t[-1], samples.period
    if max(before, after) > period:
        raise InputError(
            f"imu_time_stamps: the frames from {float(frames[0])!r} to {float(frames[-1])!r} s reach beyond the "
            f"samples from {float(samples.t[0])!r} to {float(samples.t[-1])!r} s by more than a sample period "
            f"({period:.4g} s)"
        )
    inside = samples.t[(samples.t > frames[0]) & (samples.t < frames[-1])]
    knots = np.union1d(frames, inside)
    values = np.concatenate([samples.angular_velocity, samples.specific_force], axis=1)
    at = np.stack([np.interp(knots, samples.t, column) for column in values.T], axis=1)
    held = 0.5 * (at[:-1] + at[1:])
    starts = np.searchsorted(knots, frames).astype(np.int64)
    densities = interval_densities(samples, frames)
    return ImuIntervals(starts, np.diff(knots), held[:, :3], held[:, 3:], samples.noise, samples.gravity, densities)
