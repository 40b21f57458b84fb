"""Strapdown equations: motion, transition and noise over samples of angular velocity and specific force.

Over a piece of dt seconds with constant angular velocity w and specific force a, both free of bias, with phi = w dt:

    R' = R Exp(phi)
    v' = v + g dt + R J1(phi) a dt              J1 = integral of Exp(s phi) over s from 0 to 1
    p' = p + v dt + g dt^2 / 2 + R J2(phi) a dt^2    J2 = integral of (1 - s) Exp(s phi)

These are exact for constant w and a (Forster et al., *On-Manifold Preintegration*, IEEE T-RO 2017, equation 26, which
holds R over a sample, is their limit for short pieces). g is the gravity vector in the world.

Errors are [translation, rotation, velocity, gyroscope bias, accelerometer bias] (15,): T = T^ Exp(delta) on the right,
v = v^ + dv, b = b^ + db. Within this module velocity errors are in the axes of the body, `u = R^T dv`: the transition
then depends on nothing but the samples. `world_axes` takes it to the world.
"""

from typing import NamedTuple

import numpy as np

from .se3 import higher_coefficients
from .so3 import FloatArray, angle_coefficients, exp_so3, hat3

STATE = 15
TRANSLATION, ROTATION, VELOCITY, GYROSCOPE_BIAS, ACCELEROMETER_BIAS = (slice(i, i + 3) for i in range(0, STATE, 3))
"""blocks of the error state"""
SMALL = 0.1
"""rad, below which derivatives of the coefficients are taken from their series"""


class ImuMotion(NamedTuple):
    """Motion over an interval, relative to its first body frame and free of gravity and of the initial velocity."""

    rotation: FloatArray
    """(3, 3) Delta R"""
    velocity: FloatArray
    """(3,) Delta v, m/s"""
    position: FloatArray
    """(3,) Delta p, m"""
    dt: float
    """s"""
    transition: FloatArray
    """(15, 15) F of the error state, velocity errors in body axes"""
    noise: FloatArray
    """(15, 15) Q, velocity errors in body axes"""


class _Pieces(NamedTuple):
    rotation: FloatArray
    velocity: FloatArray
    position: FloatArray
    transition: FloatArray


def _integrals(phi: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Coefficients (n,) of W and W^2 in J1, and of W and W^2 in J2, of rotation vectors (n, 3)."""
    angle = np.linalg.norm(phi, axis=-1)
    c = angle_coefficients(angle)
    return c.cosine, c.cubic, c.cubic, higher_coefficients(angle)[0]


def _slopes(phi: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives by the angle x over x, (n,), of (1 - cos x) / x^2, (x - sin x) / x^3, (x^2 / 2 + cos x - 1) / x^4."""
    angle = np.linalg.norm(phi, axis=-1)
    small = angle < SMALL
    x2 = np.where(small, angle, 0.0) ** 2
    y2 = np.where(small, 1.0, angle) ** 2
    c, quartic = angle_coefficients(angle), higher_coefficients(angle)[0]
    return (
        np.where(small, -1 / 12 + x2 * (1 / 180 - x2 / 6720), (c.sine - 2.0 * c.cosine) / y2),
        np.where(small, -1 / 60 + x2 * (1 / 1260 - x2 / 60480), (c.cosine - 3.0 * c.cubic) / y2),
        np.where(small, -1 / 360 + x2 * (1 / 10080 - x2 / 604800), (c.cubic - 4.0 * quartic) / y2),
    )


def _integral(linear: FloatArray, quadratic: FloatArray, W: FloatArray, constant: float) -> FloatArray:
    return constant * np.eye(3) + linear[:, None, None] * W + quadratic[:, None, None] * (W @ W)


def _derivative(
    values: tuple[FloatArray, FloatArray],
    slopes: tuple[FloatArray, FloatArray],
    phi: FloatArray,
    force: FloatArray,
) -> FloatArray:
    """(n, 3, 3) derivative by phi of (linear W + quadratic W^2) a."""
    W, A = hat3(phi), hat3(force)
    Wa = (W @ force[:, :, None])[:, :, 0]
    WWa = (W @ Wa[:, :, None])[:, :, 0]
    linear, quadratic = (value[:, None, None] for value in values)
    d_linear, d_quadratic = (slope[:, None, None] for slope in slopes)
    along = d_linear * Wa[:, :, None] + d_quadratic * WWa[:, :, None]
    return -linear * A - quadratic * (hat3(Wa) + W @ A) + along * phi[:, None, :]


def _pieces(angular_velocity: FloatArray, specific_force: FloatArray, dt: FloatArray) -> _Pieces:
    """Motion and transition of each of n pieces."""
    phi, h = angular_velocity * dt[:, None], dt[:, None, None]
    E, W = exp_so3(phi), hat3(phi)
    a1, a2, b1, b2 = _integrals(phi)
    J1, J2 = _integral(a1, a2, W, 1.0), _integral(b1, b2, W, 0.5)
    slope1, slope2, slope3 = _slopes(phi)
    D1 = _derivative((a1, a2), (slope1, slope2), phi, specific_force)
    D2 = _derivative((b1, b2), (slope2, slope3), phi, specific_force)
    gain1 = (J1 @ specific_force[:, :, None])[:, :, 0]
    gain2 = (J2 @ specific_force[:, :, None])[:, :, 0]
    Et = np.swapaxes(E, 1, 2)
    F = np.zeros((len(dt), STATE, STATE))
    F[:, range(9, STATE), range(9, STATE)] = 1.0
    F[:, TRANSLATION, TRANSLATION] = F[:, ROTATION, ROTATION] = F[:, VELOCITY, VELOCITY] = Et
    F[:, TRANSLATION, ROTATION] = -(h**2) * (Et @ hat3(gain2))
    F[:, TRANSLATION, VELOCITY] = h * Et
    F[:, TRANSLATION, GYROSCOPE_BIAS] = -(h**3) * (Et @ D2)
    F[:, TRANSLATION, ACCELEROMETER_BIAS] = -(h**2) * (Et @ J2)
    F[:, ROTATION, GYROSCOPE_BIAS] = -h * np.swapaxes(J1, 1, 2)  # the right Jacobian of SO(3) is J1^T
    F[:, VELOCITY, ROTATION] = -h * (Et @ hat3(gain1))
    F[:, VELOCITY, GYROSCOPE_BIAS] = -(h**2) * (Et @ D1)
    F[:, VELOCITY, ACCELEROMETER_BIAS] = -h * (Et @ J1)
    return _Pieces(E, gain1 * dt[:, None], gain2 * dt[:, None] ** 2, F)


def integrate(
    angular_velocity: FloatArray, specific_force: FloatArray, dt: FloatArray, densities: FloatArray
) -> ImuMotion:
    """Motion over n consecutive pieces: angular velocities (n, 3), rad/s, and specific forces (n, 3), m/s^2, less bias.

    `densities` (4,): noise density and random walk of the gyroscope (rad/s/sqrt(Hz), rad/s^2/sqrt(Hz)), then of the
    accelerometer (m/s^2/sqrt(Hz), m/s^3/sqrt(Hz)). White noise is held over a piece, with a variance of
    density^2 / dt: it acts as a bias of that piece does.
    """
    pieces = _pieces(angular_velocity, specific_force, dt)
    sensed = pieces.transition[:, :9, 9:]
    variance = np.repeat(densities[[0, 2]] ** 2, 3) / dt[:, None]
    white = (sensed * variance[:, None, :]) @ np.swapaxes(sensed, 1, 2)
    walk = np.repeat(densities[[1, 3]] ** 2, 3) * dt[:, None]
    R, v, p, total = np.eye(3), np.zeros(3), np.zeros(3), 0.0
    F, Q = np.eye(STATE), np.zeros((STATE, STATE))
    for i, h in enumerate(dt.tolist()):
        p = p + v * h + R @ pieces.position[i]
        v = v + R @ pieces.velocity[i]
        R = R @ pieces.rotation[i]
        total += h
        F = pieces.transition[i] @ F
        Q = pieces.transition[i] @ Q @ pieces.transition[i].T
        Q[:9, :9] += white[i]
        Q[range(9, STATE), range(9, STATE)] += walk[i]
    return ImuMotion(R, v, p, total, F, 0.5 * (Q + Q.T))


def predict(
    pose: FloatArray, velocity: FloatArray, motion: ImuMotion, gravity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Pose (4, 4) and velocity (3,), m/s, after a motion from `pose` and `velocity`, under gravity (3,), m/s^2."""
    R, dt = pose[:3, :3], motion.dt
    after = np.eye(4)
    after[:3, :3] = R @ motion.rotation
    after[:3, 3] = pose[:3, 3] + velocity * dt + 0.5 * gravity * dt**2 + R @ motion.position
    return after, velocity + gravity * dt + R @ motion.velocity


def world_axes(motion: ImuMotion, before: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Transition F and noise Q (15, 15) with velocity errors in world axes, for rotations (3, 3) before and after."""
    F, Q = motion.transition.copy(), motion.noise.copy()
    F[VELOCITY] = after @ F[VELOCITY]
    F[:, VELOCITY] = F[:, VELOCITY] @ before.T
    Q[VELOCITY] = after @ Q[VELOCITY]
    Q[:, VELOCITY] = Q[:, VELOCITY] @ after.T
    return F, Q
