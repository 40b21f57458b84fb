"""Pose initialization: the predicted pose of a new frame, refined on its observations of known landmarks.

A robust factor gets its weight at its first linearization. At the predicted pose inliers have large residuals and are
down-weighted until the pose is relinearized; so the first linearization is done nearer to the solution.
"""

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.measurement import predict

MAX_STEPS = 4
SMALL_STEP = 0.1
"""standard deviations: a correction after which the weights no longer matter"""


def refine_predicted_pose(
    problem: Problem, information: FloatArray, pose: FloatArray, points: FloatArray, pixel: FloatArray
) -> FloatArray:
    """Predicted pose (4, 4) of a frame, refined on n observations (n, 4) of known points (n, 3).

    Gauss-Newton on the cost of the problem, kernel included, with previous pose and points fixed. `information` (6, 6)
    is that of the increment, order [v, w]. The result is an initial value only.
    """
    observed = _KnownLandmarks(problem, points, pixel)
    guess, correction = pose, np.zeros(6)
    for _ in range(MAX_STEPS):
        linearized = observed.linearize(guess)
        if linearized is None:
            return pose
        J, residual = linearized
        A = J.T @ J + information
        delta = np.linalg.solve(A, J.T @ residual - information @ correction)
        guess = guess @ se3.exp(delta)
        correction = correction + delta  # to first order in the turn, which is small
        if delta @ A @ delta < SMALL_STEP**2:
            break
    return guess


class _KnownLandmarks:
    """Observations of known landmarks in one frame."""

    def __init__(self, problem: Problem, points: FloatArray, pixel: FloatArray) -> None:
        self._points, self._model = points, problem.measurement
        self._cam_T_imu = se3.inverse(problem.sequence.imu_T_cam)
        self._measured = problem.measurement.measured(pixel)

    def linearize(self, pose: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Jacobian (rm, 6) for a perturbation of the pose and residuals (rm,), whitened and weighted by the kernel, of
        the m points that are in front of the camera; None if none is."""
        model = self._model
        with np.errstate(divide="ignore", invalid="ignore"):  # at the camera's plane
            predicted = predict(model.camera, self._cam_T_imu, pose, self._points)
            J = predicted.pose_jacobian()
        front = predicted.depth > model.camera.min_depth
        if not front.any():
            return None
        residual = (self._measured - predicted.pixel)[front] * model.whitening_scale
        root = np.sqrt(model.weight(np.einsum("ni,ni->n", residual, residual)))[:, None]
        J = J[front] * (model.whitening_scale * root)[:, :, None]
        return J.reshape(-1, 6), (residual * root).ravel()
