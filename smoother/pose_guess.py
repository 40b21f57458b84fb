"""Where a new frame's pose is likely to be: its prediction, corrected by what the frame sees of known landmarks.

A factor under a kernel gets its weight where it is first linearised. At the predicted pose good observations look
wrong and are weighted down, until the pose is relinearised; so the first linearisation is done nearer to the answer.
"""

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3, so3

from .undone import MIN_DEPTH

MAX_STEPS = 4
SMALL_STEP = 0.1
"""standard deviations: a correction after which the weights no longer matter"""


def corrected(
    problem: Problem, information: FloatArray, pose: FloatArray, points: FloatArray, pixel: FloatArray
) -> FloatArray:
    """The pose (4, 4) of a frame that its prediction and n sights (n, 4) of points (n, 3) agree on.

    Gauss-Newton on the problem's cost, kernel included, with the frame before and the points held: what is uncertain
    of the two together does not move one against the other. `information` (6, 6) is the increment's, order [v, w].
    Only a start.
    """
    sights = _Sights(problem, points, pixel)
    guess, correction = pose, np.zeros(6)
    for _ in range(MAX_STEPS):
        linearised = sights.linearised(guess)
        if linearised is None:
            return pose
        J, residual = linearised
        A = J.T @ J + information
        delta = np.linalg.solve(A, J.T @ residual - information @ correction)
        guess = guess @ se3.exp(delta)
        correction = correction + delta  # to first order in the turn, which is small
        if delta @ A @ delta < SMALL_STEP**2:
            break
    return guess


class _Sights:
    """What one frame sees of known points, in rows (uL, uR, sqrt(2) v), which are of one variance."""

    def __init__(self, problem: Problem, points: FloatArray, pixel: FloatArray) -> None:
        camera, root2 = problem.sequence.camera, np.sqrt(2.0)
        self._points, self._variance = points, problem.pixel_variance
        self._threshold = np.inf if problem.kernel is None else problem.kernel.threshold
        self._cam_T_imu = se3.inverse(problem.sequence.imu_T_cam)
        self._focal = np.array([camera.fu, camera.fu, root2 * camera.fv])
        centre = np.array([camera.cu, camera.cu, root2 * camera.cv])
        self._measured = np.column_stack([pixel[:, 0], pixel[:, 2], (pixel[:, 1] + pixel[:, 3]) / root2]) - centre
        self._baseline = camera.baseline

    def linearised(self, pose: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Jacobian (3m, 6) for a perturbation of the pose and residuals (3m,), whitened and weighted by the kernel, of
        the m points that are ahead; None if none is."""
        p_imu = (self._points - pose[:3, 3]) @ pose[:3, :3]
        R_cam_imu = self._cam_T_imu[:3, :3]
        p_cam = p_imu @ R_cam_imu.T + self._cam_T_imu[:3, 3]
        ahead = p_cam[:, 2] > MIN_DEPTH
        if not ahead.any():
            return None
        x, y, z = p_cam[ahead].T
        slope = np.stack([x, x - self._baseline, y], axis=1) / z[:, None]
        residual = self._measured[ahead] - self._focal * slope
        J_point = np.zeros((len(z), 3, 3))
        J_point[:, 0, 0] = J_point[:, 1, 0] = J_point[:, 2, 1] = 1.0
        J_point[:, :, 2] = -slope
        J_point *= self._focal[:, None] / z[:, None, None]
        squared = np.einsum("ni,ni->n", residual, residual) / self._variance
        weight = np.minimum(self._threshold / np.sqrt(np.maximum(squared, 1e-12)), 1.0)
        scale = np.sqrt(weight / self._variance)[:, None]
        J_point = J_point @ R_cam_imu * scale[:, :, None]
        # The point in the IMU's frame moves by -v - w x p.
        J = np.concatenate([-J_point, J_point @ so3.hat3(p_imu[ahead])], axis=2)
        return J.reshape(-1, 6), (residual * scale).ravel()
