"""The rotation that best takes one set of vectors to another, also where they do not determine it."""

from collections.abc import Callable

import numpy as np

from fgbaseline.geometry import FloatArray, so3

UNDETERMINED = 1e-12
"""of the largest squared extent: below it a direction of the path is rounding"""


def best_rotation(M: FloatArray, tie: Callable[[], FloatArray], floor: float) -> tuple[FloatArray, FloatArray | None]:
    """R (3, 3), a proper rotation that maximises trace(R^T M), of M (3, 3) = sum of y x^T over vectors x taken to y.

    Where M leaves rotations open (singular values below `floor` or UNDETERMINED), that one of the equally good ones
    which maximises trace(R^T tie()), and then trace(R), the smallest rotation. Beside it the axis (3,) about which M
    left R open, in the frame of y: None if there is none, zero if it left all of R open.
    """
    U, d, Vt = np.linalg.svd(M)
    if d[0] <= floor:
        return best_rotation(tie(), lambda: np.eye(3), _floor_of(tie()))[0], np.zeros(3)
    sign = 1.0 if np.linalg.det(U) * np.linalg.det(Vt) > 0 else -1.0
    R = U @ np.diag([1.0, 1.0, sign]) @ Vt
    if d[1] + sign * d[2] > max(floor, UNDETERMINED * d[0]):
        return R, None
    axis = U[:, 0]
    further, _ = best_turn(axis, tie() @ R.T, lambda: R.T, _floor_of(tie()))
    axis = axis if axis[np.argmax(np.abs(axis))] > 0 else -axis
    return further @ R, axis


def best_turn(axis: FloatArray, M: FloatArray, tie: Callable[[], FloatArray], floor: float) -> tuple[FloatArray, bool]:
    """The rotation (3, 3) about a unit axis (3,) that maximises trace(R^T M), and whether M left it open.

    There it maximises trace(R^T tie()), and if that says nothing either it is the identity.
    """
    turn, strength = _turn(axis, M)
    if strength > max(floor, UNDETERMINED * float(np.linalg.norm(M))):
        return so3.exp_so3(turn * axis), False
    turn, strength = _turn(axis, tie())
    if strength > _floor_of(tie()):
        return so3.exp_so3(turn * axis), True
    return np.eye(3), True


def _turn(axis: FloatArray, M: FloatArray) -> tuple[float, float]:
    """The best angle, rad, and by how much trace(R^T M) depends on it."""
    cosine = float(np.trace(M) - axis @ M @ axis)
    sine = float(axis @ np.array([M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]]))
    return float(np.arctan2(sine, cosine)), float(np.hypot(sine, cosine))


def _floor_of(M: FloatArray) -> float:
    return UNDETERMINED * float(np.linalg.norm(M))
