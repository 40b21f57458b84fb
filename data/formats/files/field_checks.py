"""Checks of a recording's fields, with error messages that use the names in the file."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from ...sequence import ROTATION_TOLERANCE
from ...value_range import LARGEST, measurable


def finite_stamps(key: str, array: FloatArray) -> FloatArray:
    """Stamps (T,) of an array (1, T) or (T,). Raises InputError unless they are finite and two or more."""
    if not (array.ndim == 1 or (array.ndim == 2 and array.shape[0] == 1)):
        raise InputError(f"{key}: expected shape (1, T), got {array.shape}; write one row of seconds")
    t = array.reshape(-1)
    if t.size < 2:
        raise InputError(f"{key}: a recording needs at least 2 frames, this one has {t.size}")
    broken = np.flatnonzero(~measurable(t))
    if len(broken):
        raise InputError(f"{key}: the stamp of frame {broken[0]} is {t[broken[0]]}; write seconds")
    return t


def time_stamps(key: str, array: FloatArray) -> FloatArray:
    """Stamps (T,), s, of an array (1, T) or (T,). Raises InputError unless they are finite, rising and two or more."""
    t = finite_stamps(key, array)
    late = np.flatnonzero(~(np.diff(t) > 0))
    if len(late):
        k = int(late[0])
        raise InputError(
            f"{key}: stamps must rise, but frame {k + 1} ({float(t[k + 1])!r} s) is not after frame {k} "
            f"({float(t[k])!r} s); sort the frames and remove repeated ones"
        )
    return t


def vectors(key: str, array: FloatArray) -> FloatArray:
    """Vectors (T, 3) of an array (3, T). Raises InputError where one is not finite or beyond LARGEST."""
    broken = np.flatnonzero(~measurable(array).all(axis=0))
    if len(broken):
        k = broken[0]
        needed = "three finite numbers"
        if np.isfinite(array[:, k]).all():
            needed = f"three numbers that a sensor can measure, at most {LARGEST:g}"
        raise InputError(f"{key}: frame {k} has {array[:, k].tolist()}; every frame needs {needed}")
    return np.ascontiguousarray(array.T)


def extrinsic(key: str, imu_R_cam: FloatArray, position: FloatArray) -> FloatArray:
    """`imu_T_cam` (4, 4) of rotation (3, 3) and position (3,), m. Raises InputError when it is no rigid motion."""
    if not (measurable(imu_R_cam).all() and measurable(position).all()):
        raise InputError(
            f"{key}: it has entries that are not finite or beyond {LARGEST:g}; write the extrinsic as a rigid motion"
        )
    defect = float(so3.orthogonality_error(imu_R_cam))
    if not defect <= ROTATION_TOLERANCE:
        raise InputError(
            f"{key}: its 3x3 block {imu_R_cam.tolist()} is not a rotation (off by {defect:.3g}, allowed "
            f"{ROTATION_TOLERANCE:g}); write the extrinsic as a rigid motion"
        )
    imu_T_cam = np.eye(4)
    imu_T_cam[:3, :3] = imu_R_cam
    imu_T_cam[:3, 3] = position
    return imu_T_cam


def positive(key: str, value: FloatArray, what: str) -> float:
    """The one number in an array of any shape. Raises InputError unless it is above 0 and at most LARGEST."""
    if value.size != 1:
        raise InputError(f"{key}: expected one number, {what}, got shape {value.shape}")
    number = float(value.reshape(-1)[0])
    if not 0 < number <= LARGEST:
        raise InputError(f"{key}: expected a positive number, {what}, got {number!r}")
    return number
