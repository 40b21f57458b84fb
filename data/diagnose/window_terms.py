"""What a window of frames is fitted to: its data, and the residuals of pixels and velocities with their derivatives."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, StereoCamera, se3, so3

from ..observations import IntArray

SHARED = 8
"""gyroscope bias (3, rad/s), velocity scale minus one, the rotation vector (3, rad) by which the axes of the recorded
velocities are turned against those of imu_T_cam: recorded = [(1 + s) exp(phi) v, exp(phi) w + b]; and the disparity
offset d (px) by which uR is recorded too far to the right, all disparities too small: recorded uR = uR + d"""
SCALE = 3
"""of the shared parameters"""
TURN = slice(4, 7)
"""of the shared parameters"""
OFFSET = 7
"""of the shared parameters"""
HUBER = 2.5
"""sigmas of the norm of an observation's three rows"""
NEAREST = 0.3
"""m in front of the camera, from which on an observation takes part"""


@dataclass(frozen=True, slots=True)
class Sigmas:
    """Standard deviations of pixel rows (px), linear (m/s) and angular velocity (rad/s) held over an interval."""

    pixel: float
    linear: float
    angular: float


@dataclass(frozen=True, eq=False, slots=True)
class WindowData:
    """What a window of W frames with n observations of m landmarks has to explain."""

    frame: IntArray
    """(n,) 0..W-1, sorted"""
    row: IntArray
    """(n,) landmark, 0..m-1; no landmark twice in a frame"""
    pixel: FloatArray
    """(n, 3) uL, uR and (vL + vR) / 2"""
    twist: FloatArray
    """(W-1, 6) recorded [v, w] of each interval, in the axes of imu_T_cam"""
    dt: FloatArray
    """(W-1,) s"""


class PixelTerms(NamedTuple):
    """Of n observations the three rows, whitened; each coordinate is in an array of its own, since stacks of small
    matrices take far longer."""

    residual: FloatArray
    """(3, n)"""
    by_point: FloatArray
    """(3, 3, n) derivatives of the rows by the point in the world"""
    arm: FloatArray
    """(3, n) m, from the IMU to the point, in world axes: a pose that moves by v and turns by w, in world axes, changes
    the rows as a point would that moves by -v - w x arm"""
    weight: FloatArray
    """(n,) of the kernel; zero where the point is not in front of the camera"""


def pixel_terms(
    camera: StereoCamera,
    imu_T_cam: FloatArray,
    data: WindowData,
    poses: FloatArray,
    points: FloatArray,
    sigma: float,
    offset: float,
) -> PixelTerms:
    """At poses (W, 4, 4) and points (m, 3), for a noise of `sigma` px and a disparity offset of `offset` px."""
    point = np.take(np.ascontiguousarray(points.T), data.row, axis=1)
    world_T_cam = np.ascontiguousarray(np.moveaxis((poses @ imu_T_cam)[:, :3], 0, 2))
    of_frame = np.take(world_T_cam, data.frame, axis=2)
    axes, seen_from = of_frame[:, :3], of_frame[:, 3]
    x, y, z = (axes * (point - seen_from)[:, None]).sum(axis=0)
    front = z > NEAREST
    x[~front], y[~front], z[~front] = 0.0, 0.0, 1.0
    near = 1.0 / (sigma * z)
    u, v, apart = x / z, y / z, camera.fu * camera.baseline / z
    by_point = np.empty((3, 3, len(x)))
    by_point[0] = camera.fu * near * (axes[:, 0] - u * axes[:, 2])
    by_point[1] = by_point[0] + apart * near * axes[:, 2]
    by_point[2] = np.sqrt(2.0) * camera.fv * near * (axes[:, 1] - v * axes[:, 2])
    left = camera.fu * u + camera.cu
    residual = data.pixel.T - np.stack([left, left - apart + offset, camera.fv * v + camera.cv])
    residual /= sigma
    residual[2] *= np.sqrt(2.0)
    norm = np.sqrt((residual**2).sum(axis=0))
    weight = np.where(front, HUBER / np.maximum(norm, HUBER), 0.0)
    arm = point - np.take(np.ascontiguousarray(poses[:, :3, 3].T), data.frame, axis=1)
    return PixelTerms(residual, by_point, arm, weight)


def motion_terms(
    data: WindowData, poses: FloatArray, sigmas: Sigmas, shared: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Whitened residuals (W-1, 6), recorded minus that of the poses, and minus their Jacobians: by the pose before and
    after (6x6 each) and by the shared parameters (6x8)."""
    whiten = 1.0 / np.repeat([sigmas.linear, sigmas.angular], 3)
    relative = se3.relative(poses)
    twist = se3.log(relative) / data.dt[:, None]
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = so3.exp_so3(shared[TURN])
    turn[:3, :3] *= 1.0 + shared[3]
    predicted = twist @ turn.T
    predicted[:, 3:] += shared[:3]
    # log(exp(xi) exp(d)) = xi + J_r^-1(xi) d, to second order in the small rotation of one interval
    curly = se3.curly_hat(twist * data.dt[:, None])
    J_after = turn @ (np.eye(6) + 0.5 * curly + curly @ curly / 12.0) / data.dt[:, None, None]
    J_before = -J_after @ se3.adjoint(se3.inverse(relative))
    J_shared = np.zeros((len(twist), 6, SHARED))
    J_shared[:, 3:, :3] = np.eye(3)
    J_shared[:, :3, 3] = predicted[:, :3] / (1.0 + shared[3])
    J_shared[:, :3, TURN] = -so3.hat3(predicted[:, :3])
    J_shared[:, 3:, TURN] = -so3.hat3(predicted[:, 3:] - shared[:3])
    residual = (data.twist - predicted) * whiten
    return residual, J_before * whiten[:, None], J_after * whiten[:, None], J_shared * whiten[:, None]
