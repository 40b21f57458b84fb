"""Strapdown equations: motion, transition and noise over samples of angular velocity and specific force.

A piece is the interval between neighboring instants of samples and frames. Over a piece of dt seconds with constant
angular velocity w (rad/s) and specific force a (m/s^2) in the body frame, bias removed, with phi = w dt:

    R' = R Exp(phi)
    v' = v + g dt + R J1(phi) a dt              J1 = integral of Exp(s phi) over s from 0 to 1
    p' = p + v dt + g dt^2 / 2 + R J2(phi) a dt^2    J2 = integral of (1 - s) Exp(s phi) over s from 0 to 1

R is world_R_body, v and p are in the world, and g is the gravity vector in the world. The equations are exact for
constant w and a. Forster et al. (*On-Manifold Preintegration*, IEEE T-RO 2017, section V) hold R constant over a
sample, the limit for short pieces.

The error state is [translation, rotation, velocity, gyroscope bias, accelerometer bias] (15,) in m, rad, m/s, rad/s and
m/s^2: T = T^ Exp(delta) on the right, v = v^ + dv, b = b^ + db. Transition and noise have velocity errors in body axes,
`u = R^T dv`, so that they depend on the samples only. `world_axes` converts them to velocity errors in world axes.
"""

import math
from typing import NamedTuple

import numpy as np

from .so3 import FloatArray, hat3

STATE = 15
TRANSLATION, ROTATION, VELOCITY, GYROSCOPE_BIAS, ACCELEROMETER_BIAS = (slice(i, i + 3) for i in range(0, STATE, 3))
"""blocks of the error state"""
BLOCKS = {
    "translation": TRANSLATION,
    "rotation": ROTATION,
    "velocity": VELOCITY,
    "gyroscope_bias": GYROSCOPE_BIAS,
    "accelerometer_bias": ACCELEROMETER_BIAS,
}
"""blocks of the error state by name, 3 degrees of freedom each"""
SMALL = 1.0
"""rad; below this angle coefficients are computed from their series, as the closed forms lose digits there"""
_TERMS = 9
"""terms of the series, enough for double precision"""
_SERIES = np.array(
    [[1.0 / math.factorial(2 * k + m) for k in range(_TERMS)] for m in (1, 2, 3, 4)]
    + [[-2.0 * (k + 1) / math.factorial(2 * k + 2 + m) for k in range(_TERMS)] for m in (2, 3, 4)]
)


class PreintegratedImu(NamedTuple):
    """Motion over an interval, relative to its first body frame and free of gravity and of the initial velocity."""

    rotation: FloatArray
    """(3, 3) Delta R, from the last body frame to the first"""
    velocity: FloatArray
    """(3,) Delta v, m/s, in the first body frame"""
    position: FloatArray
    """(3,) Delta p, m, in the first body frame"""
    dt: float
    """s"""
    transition: FloatArray
    """(15, 15) F of the error state, velocity errors in body axes"""
    noise: FloatArray
    """(15, 15) Q, velocity errors in body axes"""


def _coefficients(angle: FloatArray) -> FloatArray:
    """f1, f2, f3, f4 (f_m the sum of (-x^2)^k / (2k + m)!) and f2'/x, f3'/x, f4'/x (' = d/dx) of n angles x: (7, n).

    f1 to f4 are sin x / x, (1 - cos x) / x^2, (x - sin x) / x^3 and (x^2 / 2 + cos x - 1) / x^4.
    """
    small = angle < SMALL
    series = _SERIES @ (-(np.where(small, angle, 0.0) ** 2)) ** np.arange(_TERMS)[:, None]
    if small.all():
        return np.asarray(series)
    x = np.where(small, 1.0, angle)
    f1, f2, f3 = np.sin(x) / x, (1.0 - np.cos(x)) / x**2, (x - np.sin(x)) / x**3
    f4 = (0.5 - f2) / x**2
    closed = np.stack([f1, f2, f3, f4, (f1 - 2.0 * f2) / x**2, (f2 - 3.0 * f3) / x**2, (f3 - 4.0 * f4) / x**2])
    return np.where(small, series, closed)


def _pieces(phi: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Exp(phi) (n, 3, 3) and [J1, J2, d(J1 a)/dphi, d(J2 a)/dphi] (n, 3, 12) of n pieces.

    `phi` (n, 3) is a piece's rotation vector, `force` (n, 3) its specific force a.
    """
    f1, f2, f3, f4, s2, s3, s4 = _coefficients(np.sqrt(np.einsum("ni,ni->n", phi, phi)))[:, :, None, None]
    W, A = hat3(np.stack([phi, force]))
    products = W @ np.concatenate([W, A, force[:, :, None]], axis=2)
    WW, WA, Wa = products[:, :, :3], products[:, :, 3:6], products[:, :, 6:]
    WWa, row = W @ Wa, phi[:, None, :]
    minus_WW_slope = hat3(Wa[:, :, 0]) + WA
    return np.eye(3) + f1 * W + f2 * WW, np.concatenate(
        [
            np.eye(3) + f2 * W + f3 * WW,
            0.5 * np.eye(3) + f3 * W + f4 * WW,
            (s2 * Wa + s3 * WWa) * row - f2 * A - f3 * minus_WW_slope,
            (s3 * Wa + s4 * WWa) * row - f3 * A - f4 * minus_WW_slope,
        ],
        axis=2,
    )


def integrate(
    angular_velocity: FloatArray, specific_force: FloatArray, dt: FloatArray, densities: FloatArray
) -> PreintegratedImu:
    """Motion over n pieces, `dt` (n,) s; angular velocities (n, 3), rad/s, specific forces (n, 3), m/s^2, without bias.

    `densities` (4,): noise density and random walk of the gyroscope (rad/s/sqrt(Hz), rad/s^2/sqrt(Hz)), then of the
    accelerometer (m/s^2/sqrt(Hz), m/s^3/sqrt(Hz)). White noise is constant over a piece, with variance
    density^2 / dt, and acts like a bias of that piece alone.

    G (9, 6) of a piece is the derivative of the final pose and velocity w.r.t. the biases during that piece. It is in
    closed form, as the transition over the later pieces is. The derivative w.r.t. constant biases is the sum of all G;
    w.r.t. a random-walk step after a piece it is the sum of G over the later pieces.
    """
    n = len(dt)
    rotation, columns = _pieces(angular_velocity * dt[:, None], specific_force)
    R = np.empty((n + 1, 3, 3))  # before each piece and at the end, in the first body frame
    R[0] = np.eye(3)
    for i in range(n):
        np.matmul(R[i], rotation[i], out=R[i + 1])
    end = R[-1].T.copy()
    columns *= np.repeat(np.stack([dt, dt**2, dt**2, dt**3], axis=1), 3, axis=1)[:, None, :]
    turned = (end @ R[:-1]) @ columns  # from here on, all vectors are in the last body frame
    J1_dt, J2_dt2, J1_dt_slope, J2_dt2_slope = (turned[:, :, i : i + 3] for i in range(0, 12, 3))
    steps = turned[:, :, :6].reshape(n, 3, 2, 3) @ specific_force[:, None, :, None]
    v = np.cumsum(steps[:, :, 0, 0], axis=0)  # after each piece
    p = np.cumsum(steps[:, :, 1, 0] + (v - steps[:, :, 0, 0]) * dt[:, None], axis=0)
    elapsed = np.cumsum(dt)
    left = (elapsed[-1] - elapsed)[:, None]  # after each piece
    v_left = v[-1] - v
    by_turn = hat3(np.stack([p[-1] - p - v * left, v_left])) @ J1_dt
    G = np.zeros((n, 9, 6))
    G[:, TRANSLATION, :3] = by_turn[0] - left[:, :, None] * J1_dt_slope - J2_dt2_slope
    G[:, TRANSLATION, 3:] = -J2_dt2 - left[:, :, None] * J1_dt
    G[:, ROTATION, :3] = G[:, VELOCITY, 3:] = -J1_dt
    G[:, VELOCITY, :3] = by_turn[1] - J1_dt_slope
    total = G.sum(axis=0)
    later = np.zeros((n, STATE, 6))  # derivatives w.r.t. a step of the walk
    later[:, :9] = total - np.cumsum(G, axis=0)
    later[:, 9:] = np.eye(6)
    white, walk = np.repeat(densities[[0, 2]], 3), np.repeat(densities[[1, 3]], 3)
    Q = _gram(later * walk, dt)
    Q[:9, :9] += _gram(G * white, 1.0 / dt)
    P, V = hat3(np.stack([p[-1], v[-1]]))
    F = np.eye(STATE)
    F[TRANSLATION, TRANSLATION] = F[ROTATION, ROTATION] = F[VELOCITY, VELOCITY] = end
    F[TRANSLATION, ROTATION], F[TRANSLATION, VELOCITY] = -P @ end, elapsed[-1] * end
    F[VELOCITY, ROTATION] = -V @ end
    F[:9, 9:] = total
    return PreintegratedImu(R[-1], R[-1] @ v[-1], R[-1] @ p[-1], float(elapsed[-1]), F, Q)


def _gram(factors: FloatArray, weight: FloatArray) -> FloatArray:
    """Sum (m, m) of w A A^T over factors A (n, m, 6) with weights w (n,)."""
    stacked = np.swapaxes(factors * np.sqrt(weight)[:, None, None], 0, 1).reshape(factors.shape[1], -1)
    product: FloatArray = stacked @ stacked.T
    return product


def predict(
    pose: FloatArray, velocity: FloatArray, motion: PreintegratedImu, gravity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Pose (4, 4) and velocity (3,), m/s, after a motion from `pose` and `velocity`, under gravity (3,), m/s^2."""
    R, dt = pose[:3, :3], motion.dt
    after = np.eye(4)
    after[:3, :3] = R @ motion.rotation
    after[:3, 3] = pose[:3, 3] + velocity * dt + 0.5 * gravity * dt**2 + R @ motion.position
    return after, velocity + gravity * dt + R @ motion.velocity


def world_axes(motion: PreintegratedImu, before: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Transition F and noise Q (15, 15) with velocity errors in world axes, for rotations (3, 3) before and after."""
    return rotated_velocity(motion.transition, after, before), rotated_velocity(motion.noise, after, after)


def rotated_velocity(matrix: FloatArray, rows: FloatArray, columns: FloatArray) -> FloatArray:
    """Transitions or covariances (..., 15, 15) of error states, with velocity errors in other axes.

    `rows` and `columns` (..., 3, 3) are new_R_old for the velocity errors that the matrix outputs (rows) and takes as
    input (columns). For a covariance both are the same.
    """
    rotated = matrix.copy()
    rotated[..., VELOCITY, :] = rows @ rotated[..., VELOCITY, :]
    rotated[..., VELOCITY] = rotated[..., VELOCITY] @ np.swapaxes(columns, -1, -2)
    return rotated
