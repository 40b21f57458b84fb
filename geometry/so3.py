"""Rotations on stacked arrays.

Rotation vectors are in radians; a rotation matrix `a_R_b` takes coordinates in b to coordinates in a.
The last one (vectors) or two (matrices) axes hold the object, every axis before them is a batch.
Formulas: T. Barfoot, *State Estimation for Robotics* (2017), chapter 7; below an angle of 1e-4 the
closed forms lose digits and their Taylor series, exact to machine precision there, take over.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
"""Arrays of doubles, of any shape."""

SMALL_ANGLE = 1e-4
"""rad; below this angle coefficients are computed from their Taylor series"""


def hat3(vector: ArrayLike) -> FloatArray:
    """Skew-symmetric matrices (..., 3, 3) with `hat3(a) @ b == cross(a, b)` of vectors (..., 3)."""
    a = np.asarray(vector, dtype=np.float64)
    matrix = np.zeros((*a.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -a[..., 2], a[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = a[..., 2], -a[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -a[..., 1], a[..., 0]
    return matrix


class AngleCoefficients(NamedTuple):
    """Scalar functions of a rotation angle in the closed forms of SO(3) and SE(3)."""

    sine: FloatArray
    """sin(x) / x"""
    cosine: FloatArray
    """(1 - cos(x)) / x^2"""
    cubic: FloatArray
    """(x - sin(x)) / x^3"""


def angle_coefficients(angle: FloatArray) -> AngleCoefficients:
    """The coefficients of angles (...,) in radians, each (...,)."""
    small = angle < SMALL_ANGLE
    x = np.where(small, 1.0, angle)
    x2 = angle * angle
    return AngleCoefficients(
        sine=np.where(small, 1.0 - x2 / 6.0, np.sin(x) / x),
        # 2 sin^2(x/2) avoids the cancellation in 1 - cos(x).
        cosine=np.where(small, 0.5 - x2 / 24.0, 2.0 * np.sin(0.5 * x) ** 2 / (x * x)),
        cubic=np.where(small, 1.0 / 6.0 - x2 / 120.0, (x - np.sin(x)) / (x * x * x)),
    )


def exp_so3(rotation_vector: ArrayLike) -> FloatArray:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) in radians (Rodrigues)."""
    phi = np.asarray(rotation_vector, dtype=np.float64)
    c = angle_coefficients(np.linalg.norm(phi, axis=-1))
    skew = hat3(phi)
    result: FloatArray = np.eye(3) + c.sine[..., None, None] * skew + c.cosine[..., None, None] * (skew @ skew)
    return result


def log_so3(rotation: ArrayLike) -> FloatArray:
    """Rotation vectors (..., 3), of length at most pi, of rotation matrices (..., 3, 3).

    Goes through the unit quaternion, which is accurate at every angle, pi included.
    """
    q = quaternion_xyzw(rotation)
    vector, scalar = q[..., :3], q[..., 3]
    length = np.linalg.norm(vector, axis=-1)
    small = length < 1e-9
    half_angle = np.arctan2(length, scalar)
    factor = np.where(small, 2.0, 2.0 * half_angle / np.where(small, 1.0, length))
    result: FloatArray = factor[..., None] * vector
    return result


def quaternion_xyzw(rotation: ArrayLike) -> FloatArray:
    """Unit quaternions (..., 4), ordered x y z w with w >= 0, of rotation matrices (..., 3, 3).

    The largest of the four components is found first and the others from it, so that no
    orientation loses digits (Shepperd, 1978).
    """
    R = np.asarray(rotation, dtype=np.float64)
    trace = np.trace(R, axis1=-2, axis2=-1)
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    squares = np.concatenate([1.0 - trace[..., None] + 2.0 * diagonal, 1.0 + trace[..., None]], axis=-1)
    x, y, z = 0, 1, 2
    products = np.empty((*R.shape[:-2], 4, 4))
    products[..., np.arange(4), np.arange(4)] = squares
    for i, j in ((x, y), (x, z), (y, z)):
        products[..., i, j] = products[..., j, i] = R[..., i, j] + R[..., j, i]
    for i, j, k in ((x, y, z), (y, z, x), (z, x, y)):
        products[..., i, 3] = products[..., 3, i] = R[..., k, j] - R[..., j, k]
    largest = np.argmax(squares, axis=-1)
    q = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    result: FloatArray = np.where(q[..., 3:] < 0.0, -q, q)
    return result


def rotation_from_quaternion(xyzw: ArrayLike) -> FloatArray:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), x y z w, which are normalized here."""
    q = np.asarray(xyzw, dtype=np.float64)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    skew = hat3(q[..., :3])
    result: FloatArray = np.eye(3) + 2.0 * q[..., 3, None, None] * skew + 2.0 * (skew @ skew)
    return result


def rotation_angle(rotation: ArrayLike) -> FloatArray:
    """Angles (...,) in radians, 0 to pi, of rotation matrices (..., 3, 3).

    From sine (antisymmetric part) and cosine (trace) together, which is accurate to rounding at every angle.
    """
    R = np.asarray(rotation, dtype=np.float64)
    twice_sine = np.sqrt(
        (R[..., 2, 1] - R[..., 1, 2]) ** 2 + (R[..., 0, 2] - R[..., 2, 0]) ** 2 + (R[..., 1, 0] - R[..., 0, 1]) ** 2
    )
    twice_cosine = R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1.0
    return np.asarray(np.arctan2(twice_sine, twice_cosine))


def twist_angle(axis: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Angles (...,) in radians, -pi to pi, of the twist of rotations (..., 3, 3) about a unit axis (3,).

    The twist is the rotation about the axis that is nearest to the given one (swing-twist decomposition). It is zero
    where it is undefined, at a rotation by pi about a perpendicular axis.
    """
    a, R = np.asarray(axis, dtype=np.float64), np.asarray(rotation, dtype=np.float64)
    antisymmetric = np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    cosine = np.trace(R, axis1=-2, axis2=-1) - np.einsum("i,...ij,j->...", a, R, a)
    return np.asarray(np.arctan2(antisymmetric @ a, cosine))


def rotation_to_z(vector: ArrayLike) -> FloatArray:
    """Smallest rotation (3, 3) that takes the direction of a vector (3,) to +z; about x where that is -z."""
    up = np.asarray(vector, dtype=np.float64)
    x, y, z = up / np.linalg.norm(up)
    sine = float(np.hypot(x, y))
    if sine < 1e-12:
        return np.diag([1.0, 1.0, 1.0] if z > 0.0 else [1.0, -1.0, -1.0])
    return exp_so3(np.arctan2(sine, z) / sine * np.array([y, -x, 0.0]))


def orthogonality_error(matrix: ArrayLike) -> FloatArray:
    """Largest entry of |R^T R - I| and |det R - 1| of matrices (..., 3, 3); zero for proper rotations."""
    # Separate columns are ten times as fast as stacked products and determinants.
    a, b, c = np.moveaxis(np.asarray(matrix, dtype=np.float64), (-1, -2), (0, 1)).copy()

    def dot(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.asarray(x[0] * y[0] + x[1] * y[1] + x[2] * y[2])

    cross = np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    should_be_one = (dot(a, a), dot(b, b), dot(c, c), dot(cross, c))
    should_be_zero = (dot(a, b), dot(b, c), dot(c, a))
    result: FloatArray = np.maximum.reduce(
        [np.abs(value - 1.0) for value in should_be_one] + [np.abs(value) for value in should_be_zero]
    )
    return result


def nearest_rotations(matrices: ArrayLike) -> FloatArray:
    """The rotations (..., 3, 3) nearest to matrices (..., 3, 3) in the Frobenius norm (SVD)."""
    U, _, Vt = np.linalg.svd(np.asarray(matrices, dtype=np.float64))
    U[..., 2] *= np.sign(np.linalg.det(U @ Vt))[..., None]
    return np.asarray(U @ Vt)
