"""Checks common to all trajectory files: increasing stamps and rigid motions."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from ...observations import IntArray
from ..stamps.file_stamps import Stamps

UNIT_TOLERANCE = 1e-3
"""largest deviation of a quaternion's length from 1: files with four decimals are within it; it is normalized here"""
READ_TOLERANCE = 1e-3
"""largest error of orthogonality of a rotation matrix that is read: files with four digits are within it"""
EXACT = 1e-14
"""error of orthogonality up to which rotations are left unchanged"""
WRITTEN_TOLERANCE = 1e-6
"""largest error of orthogonality of a rotation matrix to be written"""


def require_rising(stamps: Stamps, line: IntArray) -> None:
    """Raises InputError naming the first of the lines (n,) whose stamp is not after the one before."""
    late = np.flatnonzero(~stamps.rising())
    if len(late):
        i = late[0] + 1
        shown = [
            repr(float(x)) if stamps.whole is None else str(stamps.whole[i - k])
            for k, x in ((0, stamps.value[i]), (1, stamps.value[i - 1]))
        ]
        raise InputError(
            f"line {line[i]}: the time stamp {shown[0]} is not after {shown[1]} "
            f"(line {line[i - 1]}); sort the lines and remove repeated ones"
        )


def rotations_of_quaternions(xyzw: FloatArray, line: IntArray, expected: str) -> FloatArray:
    """Rotations (n, 3, 3) of quaternions (n, 4), x y z w, on the lines (n,).

    Raises InputError naming the line where a quaternion is not of length 1 (within UNIT_TOLERANCE); `expected` states
    what a line should hold.
    """
    length = np.linalg.norm(xyzw, axis=1)
    wrong = np.flatnonzero(~(np.abs(length - 1.0) <= UNIT_TOLERANCE))
    if len(wrong):
        i = wrong[0]
        raise InputError(
            f"line {line[i]}: the quaternion {xyzw[i].tolist()} has length {length[i]:.6g}; expected {expected}"
        )
    return so3.rotation_from_quaternion(xyzw)


def poses_of_matrices(values: FloatArray, line: IntArray) -> FloatArray:
    """Poses (n, 4, 4) of the 12 numbers (n, 12) on the lines (n,), their rotations made exact (the nearest one).

    Raises InputError naming the line of a rotation that is off by more than READ_TOLERANCE.
    """
    poses = np.tile(np.eye(4), (len(values), 1, 1))
    poses[:, :3, :] = values.reshape(-1, 3, 4)
    defect = so3.orthogonality_error(poses[:, :3, :3])
    wrong = np.flatnonzero(~(defect <= READ_TOLERANCE))
    if len(wrong):
        i = wrong[0]
        raise InputError(
            f"line {line[i]}: the first three columns are not a rotation (off by {defect[i]:.3g}, allowed "
            f"{READ_TOLERANCE:g}); expected r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z"
        )
    rough = defect > EXACT
    poses[rough, :3, :3] = so3.nearest_rotations(poses[rough, :3, :3])
    return poses


def writable(t: FloatArray, world_T_body: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The stamps (n,), s, and poses (n, 4, 4) that a file can hold: those that are not all NaN.

    Raises InputError when a stamp does not rise or a pose is no rigid motion.
    """
    poses = np.asarray(world_T_body, dtype=np.float64)
    stamps = np.asarray(t, dtype=np.float64)
    if stamps.ndim != 1 or poses.shape != (len(stamps), 4, 4):
        raise InputError(f"a trajectory needs stamps (n,) and poses (n, 4, 4), not {stamps.shape} and {poses.shape}")
    known = ~np.isnan(poses).all(axis=(1, 2))
    stamps, poses = stamps[known], poses[known]
    if not np.isfinite(stamps).all() or np.any(np.diff(stamps) <= 0):
        raise InputError("the time stamps of a trajectory must be finite and rise")
    finite = np.isfinite(poses).all(axis=(1, 2))
    defect = np.full(len(stamps), np.inf)
    defect[finite] = so3.orthogonality_error(poses[finite, :3, :3])
    if len(stamps) and defect.max() > WRITTEN_TOLERANCE:
        i = int(defect.argmax())
        raise InputError(
            f"pose {i} (at {float(stamps[i])!r} s) is not a rigid motion (rotation off by {defect[i]:.3g})"
        )
    return stamps, poses
