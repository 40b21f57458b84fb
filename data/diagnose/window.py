"""Bundle adjustment of a short window of frames: poses and landmarks from pixels and velocities together.

Dense and exact: landmarks are eliminated by the Schur complement, poses are few. It gives what frame-to-frame odometry
cannot, residuals with the right number of degrees of freedom, so that noise can be told from error.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fgbaseline.geometry import FloatArray, StereoCamera, se3, so3

from ..observations import IntArray
from .links import three_row_jacobian, three_rows

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
SHARED_PRIOR = np.diag(1.0 / np.array([0.1] * 3 + [0.3] + [0.1] * 3 + [1.0]) ** 2)
"""keeps what a window cannot know (a rotation about the direction of travel) from running away"""
HUBER = 2.5
"""sigmas of the norm of an observation's three rows"""


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
    """(n,) 0..W-1"""
    row: IntArray
    """(n,) landmark, 0..m-1"""
    pixel: FloatArray
    """(n, 3) uL, uR and (vL + vR) / 2"""
    twist: FloatArray
    """(W-1, 6) recorded [v, w] of each interval, in the axes of imu_T_cam"""
    dt: FloatArray
    """(W-1,) s"""


@dataclass(frozen=True, eq=False, slots=True)
class WindowFit:
    """The solution, and what is left of every measurement."""

    poses: FloatArray
    """(W, 4, 4) of the IMU, the first being the identity"""
    points: FloatArray
    """(m, 3) m"""
    shared: FloatArray
    """(8,) what all windows share: see `SHARED`"""
    shared_information: FloatArray
    """(8, 8) what the window knows of it, the poses and landmarks being unknown too, without any prior"""
    motion_residual: FloatArray
    """(W-1, 6) velocity residuals, m/s and rad/s"""
    motion_redundancy: FloatArray
    """(W-1, 6) share of each residual's variance that the fit did not absorb"""
    pixel_squared: FloatArray
    """(n,) kernel-weighted squared residual of three whitened rows"""
    degrees_of_freedom: float
    """of the pixel residuals"""
    last_covariance: FloatArray
    """(6, 6) of the right perturbation of the last pose"""


def fit_window(
    camera: StereoCamera,
    imu_T_cam: FloatArray,
    data: WindowData,
    poses: FloatArray,
    points: FloatArray,
    sigmas: Sigmas,
    shared: FloatArray,
    iterations: int,
) -> WindowFit:
    """Gauss-Newton from poses (W, 4, 4) and points (m, 3); `shared` (8,) is free too, under a wide prior."""
    cam_T_imu = se3.inverse(imu_T_cam)
    W, m = len(poses), len(points)
    n_pose = 6 * (W - 1)
    for step in range(iterations + 1):
        r_pix, J_pose, J_point, weight = _pixel_terms(
            camera, cam_T_imu, data, poses, points, sigmas.pixel, float(shared[OFFSET])
        )
        r_mot, J_before, J_after, J_shared = _motion_terms(data, poses, sigmas, shared)
        H = np.zeros((n_pose + SHARED, n_pose + SHARED))
        g = np.zeros(n_pose + SHARED)
        H[n_pose:, n_pose:] += SHARED_PRIOR
        g[n_pose:] -= SHARED_PRIOR @ shared
        _add_motion(H, g, r_mot, J_before, J_after, J_shared, W)
        Hll, gl, cross = _add_pixels(H, g, data, r_pix, J_pose, J_point, weight, sigmas.pixel, W, m)
        inverse = np.linalg.inv(Hll + 1e-9 * np.eye(3))
        flat = cross.reshape(n_pose + 1, 3 * m)
        eliminated = np.swapaxes(np.swapaxes(cross, 0, 1) @ inverse, 0, 1).reshape(n_pose + 1, 3 * m)
        with_offset = np.append(np.arange(n_pose), n_pose + OFFSET)
        H[np.ix_(with_offset, with_offset)] -= eliminated @ flat.T
        g[with_offset] -= eliminated @ gl.reshape(-1)
        if step == iterations:
            break
        delta = np.linalg.solve(H, g)
        dx = delta[:n_pose].reshape(W - 1, 6)
        dl = (inverse @ (gl - (delta[with_offset] @ flat).reshape(m, 3))[:, :, None])[:, :, 0]
        poses = np.concatenate([poses[:1], poses[1:] @ se3.exp(dx)])
        points = points + dl
        shared = shared + delta[n_pose:]
    covariance = np.asarray(np.linalg.inv(H), dtype=np.float64)
    redundancy = _motion_redundancy(covariance, J_before, J_after, J_shared, W)
    squared = weight * np.einsum("ni,ni->n", r_pix, r_pix)
    absorbed = n_pose + 3 * m + SHARED
    dof = 3.0 * len(data.frame) + 6.0 * (W - 1) - absorbed - float(redundancy.sum())
    scale = np.repeat([sigmas.linear, sigmas.angular], 3)
    return WindowFit(
        poses=poses,
        points=points,
        shared=shared,
        shared_information=np.linalg.inv(covariance[n_pose:, n_pose:]) - SHARED_PRIOR,
        motion_residual=r_mot * scale,
        motion_redundancy=redundancy,
        pixel_squared=squared,
        degrees_of_freedom=dof,
        last_covariance=covariance[n_pose - 6 : n_pose, n_pose - 6 : n_pose],
    )


def _pixel_terms(
    camera: StereoCamera,
    cam_T_imu: FloatArray,
    data: WindowData,
    poses: FloatArray,
    points: FloatArray,
    sigma: float,
    offset: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Whitened residuals (n, 3), Jacobians (n, 3, 6) by the pose and (n, 3, 3) by the point, kernel weights (n,)."""
    imu_T_world = se3.inverse(poses)[data.frame]
    s = se3.transform(imu_T_world, points[data.row])
    p_cam = se3.transform(cam_T_imu, s)
    whiten = np.array([1.0, 1.0, np.sqrt(2.0)]) / sigma
    front = p_cam[:, 2] > 0.3
    p_cam[~front] = [0.0, 0.0, 1.0]
    J = three_row_jacobian(camera, p_cam) @ cam_T_imu[:3, :3] * whiten[:, None]
    residual = (data.pixel - three_rows(camera.project(p_cam)) - [0.0, offset, 0.0]) * whiten
    norm = np.linalg.norm(residual, axis=1)
    weight = np.where(front, HUBER / np.maximum(norm, HUBER), 0.0)
    J_pose = np.concatenate([-J, J @ so3.hat3(s)], axis=2)
    return residual, J_pose, J @ imu_T_world[:, :3, :3], weight


def _motion_terms(
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


def _add_motion(
    H: FloatArray, g: FloatArray, r: FloatArray, J_before: FloatArray, J_after: FloatArray, J_shared: FloatArray, W: int
) -> None:
    tail = slice(6 * (W - 1), None)
    for k in range(W - 1):
        blocks = [(slice(6 * k, 6 * k + 6), J_after[k]), (tail, J_shared[k])]
        if k > 0:
            blocks.append((slice(6 * k - 6, 6 * k), J_before[k]))
        for at, J in blocks:
            g[at] += J.T @ r[k]
            for other, J_other in blocks:
                H[at, other] += J.T @ J_other


def _add_pixels(
    H: FloatArray,
    g: FloatArray,
    data: WindowData,
    r: FloatArray,
    J_pose: FloatArray,
    J_point: FloatArray,
    weight: FloatArray,
    sigma: float,
    W: int,
    m: int,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Adds the blocks of poses and offset; gives the landmarks' blocks (m, 3, 3), gradients (m, 3) and their cross
    (6(W-1) + 1, m, 3) with the poses and, last, the offset."""
    J_offset = np.zeros((len(r), 3, 1))
    J_offset[:, 1] = 1.0 / sigma
    A = np.concatenate([J_pose, J_offset, J_point, r[:, :, None]], axis=2) * np.sqrt(weight)[:, None, None]
    products = np.swapaxes(A, 1, 2) @ A
    by_point = _summed(products[:, 7:10, 7:], data.row, m)
    by_frame = _summed(products[:, :7][:, :, [0, 1, 2, 3, 4, 5, 6, 10]], data.frame, W)
    n_pose = 6 * (W - 1)
    offset = n_pose + OFFSET
    for k in range(1, W):
        at = slice(6 * k - 6, 6 * k)
        H[at, at] += by_frame[k, :6, :6]
        H[at, offset] += by_frame[k, :6, 6]
        H[offset, at] += by_frame[k, :6, 6]
        g[at] += by_frame[k, :6, 7]
    H[offset, offset] += by_frame[:, 6, 6].sum()
    g[offset] += by_frame[:, 6, 7].sum()
    cross = np.zeros((W, 6, m, 3))
    cross[data.frame, :, data.row, :] = products[:, :6, 7:10]
    with_offset = _summed(products[:, 6, 7:10], data.row, m)
    return by_point[:, :, :3], by_point[:, :, 3], np.concatenate([cross[1:].reshape(n_pose, m, 3), with_offset[None]])


def _summed(values: FloatArray, index: IntArray, size: int) -> FloatArray:
    n = len(index)
    gather = csr_array((np.ones(n), (index, np.arange(n))), shape=(size, n))
    return np.asarray(gather @ values.reshape(n, -1)).reshape(size, *values.shape[1:])


def _motion_redundancy(
    covariance: FloatArray, J_before: FloatArray, J_after: FloatArray, J_shared: FloatArray, W: int
) -> FloatArray:
    """(W-1, 6) 1 - diag(J Sigma J^T) of each whitened motion residual."""
    redundancy = np.empty((W - 1, 6))
    tail = np.arange(6 * (W - 1), 6 * (W - 1) + SHARED)
    for k in range(W - 1):
        columns = [np.arange(6 * k, 6 * k + 6), tail]
        blocks = [J_after[k], J_shared[k]]
        if k > 0:
            columns.append(np.arange(6 * k - 6, 6 * k))
            blocks.append(J_before[k])
        at, J = np.concatenate(columns), np.concatenate(blocks, axis=1)
        redundancy[k] = 1.0 - np.einsum("ij,jk,ik->i", J, covariance[np.ix_(at, at)], J)
    return redundancy
