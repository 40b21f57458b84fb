"""States of keyframes, inertial motions between them, and measured relative poses."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.data.problem.inertial import ImuIntervals
from fgbaseline.geometry import FloatArray, se3, so3, strapdown


@dataclass(frozen=True, eq=False, slots=True)
class States:
    """States of n keyframes in a world whose z axis points up."""

    pose: FloatArray
    """(n, 4, 4) world_T_imu"""
    velocity: FloatArray
    """(n, 3) m/s in world axes"""
    gyroscope_bias: FloatArray
    """(n, 3) rad/s"""
    accelerometer_bias: FloatArray
    """(n, 3) m/s^2"""

    def __len__(self) -> int:
        return len(self.pose)

    @property
    def biases(self) -> FloatArray:
        """Biases (n, 6) of gyroscope, rad/s, and accelerometer, m/s^2."""
        return np.concatenate([self.gyroscope_bias, self.accelerometer_bias], axis=1)

    def stepped(self, delta: FloatArray) -> "States":
        """The states after an error state `delta` (n, 15)."""
        return States(
            self.pose @ se3.exp(delta[:, :6]),
            self.velocity + delta[:, strapdown.VELOCITY],
            self.gyroscope_bias + delta[:, strapdown.GYROSCOPE_BIAS],
            self.accelerometer_bias + delta[:, strapdown.ACCELEROMETER_BIAS],
        )

    def moved(self, motion: FloatArray) -> "States":
        """The states in another world; `motion` (4, 4), new_T_old, keeps the vertical."""
        R = motion[:3, :3]
        return States(motion @ self.pose, self.velocity @ R.T, self.gyroscope_bias, self.accelerometer_bias)


@dataclass(frozen=True, eq=False, slots=True)
class Motions:
    """Inertial motions over m intervals at given biases, corrected for other biases to first order."""

    rotation: FloatArray
    """(m, 3, 3)"""
    velocity: FloatArray
    """(m, 3) m/s, without gravity and initial velocity, in the first body's axes; so is the position"""
    position: FloatArray
    """(m, 3) m"""
    dt: FloatArray
    """(m,) s"""
    transition: FloatArray
    """(m, 15, 15) velocity errors in body axes, as `strapdown.PreintegratedImu` has them"""
    noise: FloatArray
    """(m, 15, 15)"""
    biases: FloatArray
    """(m, 6) biases [gyroscope, accelerometer] that the samples were integrated with, rad/s and m/s^2"""

    def between(self, i: int) -> strapdown.PreintegratedImu:
        """The motion of interval i."""
        return strapdown.PreintegratedImu(
            self.rotation[i],
            self.velocity[i],
            self.position[i],
            float(self.dt[i]),
            self.transition[i],
            self.noise[i],
        )

    def at(self, biases: FloatArray) -> "Motions":
        """The motions at other biases (m, 6)."""
        change = (self.transition[:, :9, 9:] @ (biases - self.biases)[:, :, None])[:, :, 0]

        def along(part: slice) -> FloatArray:
            return np.asarray((rotation @ change[:, part, None])[:, :, 0])

        rotation = self.rotation @ so3.exp_so3(change[:, strapdown.ROTATION])
        velocity, position = self.velocity + along(strapdown.VELOCITY), self.position + along(strapdown.TRANSLATION)
        return Motions(rotation, velocity, position, self.dt, self.transition, self.noise, biases)


def motions_between(imu: ImuIntervals, frames: IntArray, biases: FloatArray) -> Motions:
    """The motions from one keyframe to the next, at biases (n-1, 6); `frames` (n,) are those of the imu."""
    motions = []
    for bias, a, b in zip(biases, frames[:-1].tolist(), frames[1:].tolist(), strict=True):
        at = slice(int(imu.starts[a]), int(imu.starts[b]))
        densities = np.asarray(imu.densities[a:b].max(axis=0))
        rate, force = imu.angular_velocity[at] - bias[:3], imu.specific_force[at] - bias[3:]
        motions.append(strapdown.integrate(rate, force, imu.dt[at], densities))
    return Motions(
        rotation=np.array([motion.rotation for motion in motions]),
        velocity=np.array([motion.velocity for motion in motions]),
        position=np.array([motion.position for motion in motions]),
        dt=np.array([motion.dt for motion in motions]),
        transition=np.array([motion.transition for motion in motions]),
        noise=np.array([motion.noise for motion in motions]),
        biases=biases,
    )


@dataclass(frozen=True, eq=False, slots=True)
class RelativePoses:
    """m measured poses of a keyframe in another one's frame."""

    first: IntArray
    """(m,)"""
    second: IntArray
    """(m,)"""
    motion: FloatArray
    """(m, 4, 4) imu_first_T_imu_second"""
    covariance: FloatArray
    """(m, 6, 6) of the right perturbation"""
