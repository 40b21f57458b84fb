"""Where a new frame's pose is likely to be: its prediction, corrected by what the frame sees of known landmarks.

A factor under a kernel gets its weight where it is first linearised. At the predicted pose good observations look
wrong and are weighted down, until the pose is relinearised; so the first linearisation is done nearer to the answer.
"""

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3

from .undone import MIN_DEPTH

MAX_STEPS = 4
SMALL_STEP = 0.1
"""standard deviations: a correction after which the weights no longer matter"""


def corrected(problem: Problem, frame: int, pose: FloatArray, points: FloatArray, pixel: FloatArray) -> FloatArray:
    """The pose (4, 4) of a frame that its prediction and n sights (n, 4) of points (n, 3) agree on.

    Gauss-Newton on the problem's cost, kernel included, with the frame before and the points held: what is uncertain
    of the two together does not move one against the other. Only a start.
    """
    imu_T_cam, camera = problem.sequence.imu_T_cam, problem.sequence.camera
    cam_T_imu = se3.inverse(imu_T_cam)
    information = np.linalg.inv(problem.increment_covariance[frame - 1])
    guess, correction = pose, np.zeros(6)
    for _ in range(MAX_STEPS):
        p_imu = se3.transform(se3.inverse(guess), points)
        p_cam = se3.transform(cam_T_imu, p_imu)
        ahead = p_cam[:, 2] > MIN_DEPTH
        if not ahead.any():
            return pose
        residual = pixel[ahead] - camera.project(p_cam[ahead])
        J_point = camera.jacobian(p_cam[ahead]) @ cam_T_imu[:3, :3]
        # The point in the IMU's frame moves by -v - w x p.
        J = np.concatenate([-J_point, np.cross(J_point, p_imu[ahead][:, None, :])], axis=2)
        weighted = J * (_weights(problem, residual) / problem.pixel_variance)[:, None, None]
        A = np.tensordot(weighted, J, axes=([0, 1], [0, 1])) + information
        b = np.tensordot(weighted, residual, axes=([0, 1], [0, 1])) - information @ correction
        delta = np.linalg.solve(A, b)
        guess = guess @ se3.exp(delta)
        correction = se3.log(se3.inverse(pose) @ guess)
        if delta @ A @ delta < SMALL_STEP**2:
            break
    return guess


def _weights(problem: Problem, residual: FloatArray) -> FloatArray:
    """(n,) Huber's, on the whitened norm of the three rows."""
    if problem.kernel is None:
        return np.ones(len(residual))
    row = 0.5 * (residual[:, 1] + residual[:, 3])
    squared = (residual[:, 0] ** 2 + residual[:, 2] ** 2 + 2.0 * row**2) / problem.pixel_variance
    return problem.kernel.threshold / np.sqrt(np.maximum(squared, problem.kernel.threshold**2))
