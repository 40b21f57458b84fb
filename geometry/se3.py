"""Rigid motions on stacked arrays.

Poses are 4x4 matrices `a_T_b`, which take coordinates in b to coordinates in a. Twists are `[v, w]`: translation (m)
before rotation (rad), in the body frame. Perturbations are on the right, `T = mu @ exp(delta)`, as in equations 9 and
13 of the source paper. The leading axes of every array are a batch.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from .so3 import SMALL_ANGLE, FloatArray, angle_coefficients, hat3, log_so3


def hat(twist: ArrayLike) -> FloatArray:
    """4x4 matrices (..., 4, 4) of twists (..., 6): [[hat3(w), v], [0, 0]] (equation 9)."""
    xi = np.asarray(twist, dtype=np.float64)
    matrix = np.zeros((*xi.shape[:-1], 4, 4))
    matrix[..., :3, :3] = hat3(xi[..., 3:])
    matrix[..., :3, 3] = xi[..., :3]
    return matrix


def curly_hat(twist: ArrayLike) -> FloatArray:
    """6x6 matrices (..., 6, 6) of twists (..., 6): [[hat3(w), hat3(v)], [0, hat3(w)]] (equation 9)."""
    xi = np.asarray(twist, dtype=np.float64)
    matrix = np.zeros((*xi.shape[:-1], 6, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = hat3(xi[..., 3:])
    matrix[..., :3, 3:] = hat3(xi[..., :3])
    return matrix


def exp(twist: ArrayLike) -> FloatArray:
    """Poses (..., 4, 4) of twists (..., 6): the closed form of expm(hat(twist))."""
    xi = np.asarray(twist, dtype=np.float64)
    v, w = xi[..., :3], xi[..., 3:]
    c = angle_coefficients(np.linalg.norm(w, axis=-1))
    skew = hat3(w)
    square = skew @ skew
    cosine = c.cosine[..., None, None]
    left_jacobian = np.eye(3) + cosine * skew + c.cubic[..., None, None] * square
    pose = np.zeros((*xi.shape[:-1], 4, 4))
    pose[..., :3, :3] = np.eye(3) + c.sine[..., None, None] * skew + cosine * square  # Rodrigues, as exp_so3
    pose[..., :3, 3] = (left_jacobian @ v[..., None])[..., 0]
    pose[..., 3, 3] = 1.0
    return pose


def exp_one(twist: FloatArray) -> FloatArray:
    """`exp` of one twist (6,), for loops: in plain numbers, a tenth of the time of arrays of one element each."""
    v0, v1, v2, x, y, z = map(float, twist)
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if not math.isfinite(angle):
        return np.full((4, 4), np.nan)
    if angle < SMALL_ANGLE:
        sine, cosine, cubic = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        sine, cosine = math.sin(angle) / angle, 2.0 * math.sin(0.5 * angle) ** 2 / square
        cubic = (angle - math.sin(angle)) / (square * angle)
    # hat3(w)^2 = w w^T - |w|^2 I
    along = cubic * (x * v0 + y * v1 + z * v2)
    across = 1.0 - cubic * square
    bx, by, bz, kept = cosine * x, cosine * y, cosine * z, 1.0 - cosine * square
    sx, sy, sz = sine * x, sine * y, sine * z
    return np.array(
        [
            [kept + bx * x, bx * y - sz, bx * z + sy, across * v0 + by * v2 - bz * v1 + along * x],
            [bx * y + sz, kept + by * y, by * z - sx, across * v1 + bz * v0 - bx * v2 + along * y],
            [bx * z - sy, by * z + sx, kept + bz * z, across * v2 + bx * v1 - by * v0 + along * z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def log(pose: ArrayLike) -> FloatArray:
    """Twists (..., 6) of poses (..., 4, 4), with a rotation of at most pi: the inverse of `exp`."""
    T = np.asarray(pose, dtype=np.float64)
    w = log_so3(T[..., :3, :3])
    angle = np.linalg.norm(w, axis=-1)
    c = angle_coefficients(angle)
    small = angle < 1e-4
    # (1 - (sin x / x) / (2 (1 - cos x) / x^2)) / x^2, the quadratic coefficient of the inverse left Jacobian
    quadratic = np.where(
        small,
        1.0 / 12.0 + angle**2 / 720.0,
        (1.0 - c.sine / (2.0 * c.cosine)) / np.where(small, 1.0, angle) ** 2,
    )
    skew = hat3(w)
    inverse_left_jacobian = np.eye(3) - 0.5 * skew + quadratic[..., None, None] * (skew @ skew)
    v = (inverse_left_jacobian @ T[..., :3, 3, None])[..., 0]
    return np.concatenate([v, w], axis=-1)


def inverse(pose: ArrayLike) -> FloatArray:
    """`b_T_a` (..., 4, 4) of poses `a_T_b` (..., 4, 4)."""
    T = np.asarray(pose, dtype=np.float64)
    result = np.zeros_like(T)
    Rt = np.swapaxes(T[..., :3, :3], -1, -2)
    result[..., :3, :3] = Rt
    result[..., :3, 3] = -(Rt @ T[..., :3, 3, None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def affine_inverse(matrix: ArrayLike) -> FloatArray:
    """Inverse (..., 4, 4) of matrices [[A, p], [0, 1]] (..., 4, 4), exact also if A is not exactly a rotation.

    Recorded extrinsics are rotations to about 1e-8. The transpose as the inverse would change residuals of landmarks
    near the camera plane visibly.
    """
    T = np.asarray(matrix, dtype=np.float64)
    result = np.zeros_like(T)
    A_inverse = np.linalg.inv(T[..., :3, :3])
    result[..., :3, :3] = A_inverse
    result[..., :3, 3] = -(A_inverse @ T[..., :3, 3, None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def adjoint(pose: ArrayLike) -> FloatArray:
    """6x6 adjoints (..., 6, 6) of poses (..., 4, 4), with `T exp(xi) T^-1 == exp(adjoint(T) xi)`, order [v, w]."""
    T = np.asarray(pose, dtype=np.float64)
    R, p = T[..., :3, :3], T[..., :3, 3]
    matrix = np.zeros((*T.shape[:-2], 6, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = R
    matrix[..., :3, 3:] = hat3(p) @ R
    return matrix


def right_jacobian(twist: ArrayLike) -> FloatArray:
    """J (..., 6, 6) of twists (..., 6) of any size with exp(xi + d) = exp(xi) exp(J d) for small d.

    Closed form of the sum of (-ad)^n / (n + 1)!: Barfoot (2017), equations 7.77b and 7.86b, at -xi.
    """
    xi = -np.asarray(twist, dtype=np.float64)
    V, W = hat3(xi[..., :3]), hat3(xi[..., 3:])
    angle = np.linalg.norm(xi[..., 3:], axis=-1)
    c, square, WV, VW = angle_coefficients(angle), W @ W, W @ V, V @ W
    quartic, quintic = (coefficient[..., None, None] for coefficient in higher_coefficients(angle))
    J = np.zeros((*xi.shape[:-1], 6, 6))
    J[..., :3, :3] = J[..., 3:, 3:] = np.eye(3) + c.cosine[..., None, None] * W + c.cubic[..., None, None] * square
    WVW = WV @ W
    J[..., :3, 3:] = (
        0.5 * V
        + c.cubic[..., None, None] * (WV + VW + WVW)
        + quartic * (W @ WV + VW @ W - 3.0 * WVW)
        + quintic * (WVW @ W + W @ WVW)
    )
    return J


def inverse_right_jacobian(twist: ArrayLike) -> FloatArray:
    """J (..., 6, 6) with log(exp(xi) exp(d)) = xi + J d for small d, of twists xi (..., 6) with angles below 2 pi."""
    return np.asarray(np.linalg.inv(right_jacobian(twist)), dtype=np.float64)


def higher_coefficients(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(x^2 / 2 + cos x - 1) / x^4 and (2 x - 3 sin x + x cos x) / (2 x^5) of angles x (...,); series below 0.3."""
    small = angle < 0.3
    x, y = np.where(small, 1.0, angle), np.where(small, angle, 0.0) ** 2
    quartic = 1 / 24 - y * (1 / 720 - y * (1 / 40320 - y * (1 / 3628800 - y / 479001600)))
    quintic = 1 / 120 - y * (1 / 2520 - y * (1 / 120960 - y * (1 / 9979200 - y / 1245404160)))
    return (
        np.where(small, quartic, (0.5 * x * x + np.cos(x) - 1.0) / x**4),
        np.where(small, quintic, (2.0 * x - 3.0 * np.sin(x) + x * np.cos(x)) / (2.0 * x**5)),
    )


def transform(pose: ArrayLike, points: ArrayLike) -> FloatArray:
    """Points (..., 3) in frame a of points (..., 3) in frame b, moved by `a_T_b` (..., 4, 4); batches broadcast."""
    T = np.asarray(pose, dtype=np.float64)
    p = np.asarray(points, dtype=np.float64)
    result: FloatArray = (T[..., :3, :3] @ p[..., None])[..., 0] + T[..., :3, 3]
    return result


def relative(poses: ArrayLike) -> FloatArray:
    """`k_T_(k+1)` (n-1, 4, 4), the motion from each pose to the next, of poses (n, 4, 4)."""
    T = np.asarray(poses, dtype=np.float64)
    return inverse(T[:-1]) @ T[1:]


def compose(increments: ArrayLike, start: ArrayLike | None = None) -> FloatArray:
    """Poses (n+1, 4, 4) reached from `start` (4, 4; identity by default) by increments (n, 4, 4)."""
    steps = np.asarray(increments, dtype=np.float64)
    poses = np.empty((len(steps) + 1, 4, 4))
    poses[0] = np.eye(4) if start is None else start
    for k, step in enumerate(steps):
        poses[k + 1] = poses[k] @ step
    return poses
