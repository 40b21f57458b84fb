"""Wahba's problem (Wahba, 1965): the rotation between two sets of vectors, degenerate sets included."""

from collections.abc import Callable

import numpy as np

from fgbaseline.geometry import FloatArray, so3

UNDETERMINED = 1e-12
"""share of the largest singular value, below which another one is rounding error"""


def solve_wahba(M: FloatArray, tie: Callable[[], FloatArray], floor: float) -> tuple[FloatArray, FloatArray | None]:
    """Proper rotation R (3, 3) that maximizes trace(R^T M), with M (3, 3) the sum of y x^T over vectors x rotated to y.

    M does not determine R where its singular values are below `floor`, or below UNDETERMINED of the largest. Then
    `tie()` (3, 3) replaces M for the choice among the rotations of equal trace; if it does not determine R either, the
    smallest angle decides.

    Also returns the axis (3,), in the frame of y, about which M leaves R undetermined: None if there is none, zero if
    all of R is undetermined.
    """
    U, d, Vt = np.linalg.svd(M)
    if d[0] <= floor:
        return solve_wahba(tie(), lambda: np.eye(3), _floor_of(tie()))[0], np.zeros(3)
    sign = 1.0 if np.linalg.det(U) * np.linalg.det(Vt) > 0 else -1.0
    R = U @ np.diag([1.0, 1.0, sign]) @ Vt
    if d[1] + sign * d[2] > max(floor, UNDETERMINED * d[0]):
        return R, None
    axis = U[:, 0]
    further, _ = solve_wahba_about_axis(axis, tie() @ R.T, lambda: R.T, _floor_of(tie()))
    axis = axis if axis[np.argmax(np.abs(axis))] > 0 else -axis
    return further @ R, axis


def solve_wahba_about_axis(
    axis: FloatArray, M: FloatArray, tie: Callable[[], FloatArray], floor: float
) -> tuple[FloatArray, bool]:
    """Rotation R (3, 3) about a unit axis (3,) that maximizes trace(R^T M), and whether M leaves R undetermined.

    An undetermined R maximizes trace(R^T tie()) instead, or is the identity if that does not determine it either.
    """
    angle, amplitude = _best_angle(axis, M)
    if amplitude > max(floor, UNDETERMINED * float(np.linalg.norm(M))):
        return so3.exp_so3(angle * axis), False
    angle, amplitude = _best_angle(axis, tie())
    if amplitude > _floor_of(tie()):
        return so3.exp_so3(angle * axis), True
    return np.eye(3), True


def _best_angle(axis: FloatArray, M: FloatArray) -> tuple[float, float]:
    """Best angle, rad, and the amplitude with which trace(R^T M) depends on the angle."""
    cosine = float(np.trace(M) - axis @ M @ axis)
    sine = float(axis @ np.array([M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]]))
    return float(np.arctan2(sine, cosine)), float(np.hypot(sine, cosine))


def _floor_of(M: FloatArray) -> float:
    return UNDETERMINED * float(np.linalg.norm(M))
