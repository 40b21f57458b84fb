"""Ground truth brought to the world of an inertial problem: z up, position and heading of frame 0 as they start.

Truth in the axes of its file may be tilted, and may begin late. The tilt is taken from the source where it defines up,
or from the inertial samples over all frames that have truth; yaw and translation from frame 0, or from the first frames
that have truth.
"""

import numpy as np

from fgbaseline.data.sequence import Truth
from fgbaseline.geometry import FloatArray, so3

UPRIGHT = np.deg2rad(0.5)
"""rad between the z axis of a file's world and the measured up, within which z is taken for up: the measured up is as
uncertain, and a body that begins level within a few degrees is no world"""
TIED = 20
"""frames with truth over which yaw and translation are tied, where frame 0 has none"""


def tied_truth(truth: Truth, path: FloatArray, frames_per_second: float) -> tuple[Truth, str]:
    """The truth in the world of a path (T, 4, 4) whose z axis points up, and how it was tied, in a sentence.

    The path may be NaN in frames where it is not known.
    """
    if not truth.known.any():
        return truth, "the ground truth has no pose in any frame of the problem"
    known = np.flatnonzero(truth.known & np.isfinite(path).all(axis=(1, 2)))
    if len(known) == 0:
        return truth, "the ground truth has no pose at the start of the problem and is not aligned with its world"
    up, how = _up(truth, path, known)
    level = np.eye(4)
    level[:3, :3] = so3.rotation_to_z(up)
    moved = truth.transformed(level)
    count = 1 if known[0] == 0 else min(TIED, max(3, round(frames_per_second)), len(known))
    at = known[:count]
    motion = np.eye(4)
    motion[:3, :3] = _yaw(path[at, :3, :3], moved.world_T_imu[at, :3, :3])
    turned = moved.transformed(motion)
    shift = np.eye(4)
    shift[:3, 3] = np.mean(path[at, :3, 3] - turned.world_T_imu[at, :3, 3], axis=0)
    where = "at frame 0" if count == 1 else f"over frames {at[0]} to {at[-1]}, the first with truth"
    return turned.transformed(
        shift
    ), f"the ground truth is leveled by {how}; its heading and position are aligned {where}"


def path_from(pose: FloatArray, path: FloatArray) -> FloatArray:
    """Path (T, 4, 4), z up, rotated about z and translated so that it begins at `pose` (4, 4).

    Frame 0 gets the pose itself; the others keep their tilt, which all samples determine.
    """
    motion = np.eye(4)
    motion[:3, :3] = _yaw(pose[None, :3, :3], path[:1, :3, :3])
    motion[:3, 3] = pose[:3, 3] - motion[:3, :3] @ path[0, :3, 3]
    moved = np.asarray(motion @ path, dtype=np.float64)
    moved[0] = pose
    return moved


def _up(truth: Truth, path: FloatArray, known: np.ndarray) -> tuple[FloatArray, str]:
    """Up direction (3,) in the world of the truth, and its source."""
    if truth.up is not None:
        return truth.up, "its stated up direction"
    measured = np.einsum("nij,nj->ni", truth.world_T_imu[known, :3, :3], path[known, 2, :3]).mean(axis=0)
    measured /= np.linalg.norm(measured)
    z = np.array([0.0, 0.0, 1.0])
    body = np.allclose(truth.world_T_imu[known[0], :3, :3], np.eye(3), atol=1e-9)  # a body's frame is not level
    tilt = float(np.arctan2(np.linalg.norm(np.cross(measured, z)), measured[2]))
    if not body and tilt < UPRIGHT:
        return z, f"its z axis ({np.rad2deg(tilt):.2f}° from the measured up)"
    return measured, f"the up of the inertial samples over all frames, {np.rad2deg(tilt):.1f}° from its z axis"


def _yaw(path: FloatArray, truth: FloatArray) -> FloatArray:
    """Rotation (3, 3) about z that takes rotations (n, 3, 3) of the truth nearest to those of the path."""
    z = np.array([0.0, 0.0, 1.0])
    return so3.exp_so3(so3.twist_angle(z, (path @ np.swapaxes(truth, 1, 2)).sum(axis=0)) * z)
