"""The 24 right-handed axis conventions of recorded velocities.

A convention is three signed letters. In `x,-y,-z` the IMU's x axis (the frame of `imu_T_cam`) is the recorded x, its y
is minus the recorded y, its z is minus the recorded z. Its matrix takes recorded components to the axes of `imu_T_cam`,
as `axes` in diagnosis.json does.
"""

from itertools import permutations, product

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray, InputError

IDENTITY = "x,y,z"


def axes_matrix(convention: str) -> FloatArray:
    """Signed permutation (3, 3) of a convention: `imu = axes_matrix(convention) @ recorded`.

    Raises InputError for a convention that is none of the 24.
    """
    if convention not in _MATRICES:
        raise InputError(
            f"'{convention}' is none of the 24 right-handed axis conventions; write one such as 'x,y,z' or 'x,-y,-z'"
        )
    return _MATRICES[convention].copy()


def axes_name(matrix: ArrayLike) -> str:
    """Name of the convention with this matrix (3, 3). Raises InputError when it is none of the 24."""
    wanted = np.asarray(matrix, dtype=np.float64)
    for name, known in _MATRICES.items():
        if np.array_equal(known, wanted):
            return name
    raise InputError(f"{wanted.tolist()} is none of the 24 right-handed signed permutations")


def twist_in_imu_axes(twist: FloatArray, linear: str, angular: str) -> FloatArray:
    """Twists [v, w] (n, 6) in the axes of imu_T_cam, from recorded twists with one convention per velocity."""
    return np.concatenate([twist[:, :3] @ axes_matrix(linear).T, twist[:, 3:] @ axes_matrix(angular).T], axis=1)


def _conventions() -> dict[str, FloatArray]:
    matrices = {}
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                letters = (("" if sign > 0 else "-") + "xyz"[axis] for axis, sign in zip(order, signs, strict=True))
                matrices[",".join(letters)] = matrix
    return matrices


_MATRICES = _conventions()

AXIS_CONVENTIONS: tuple[str, ...] = tuple(_MATRICES)
"""the names of all 24, `x,y,z` first"""
