"""Pose initialization: the predicted pose of a new frame, refined on its observations of known landmarks.

A robust factor gets its weight at its first linearization. At the predicted pose inliers have large residuals and are
down-weighted until the pose is relinearized; so the first linearization is done nearer to the solution.
"""

import numpy as np

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.so3 import hat3

MAX_STEPS = 4
SMALL_STEP = 0.1
"""size of a correction, in sigmas, at which the iteration ends: weights no longer change"""


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
        A, b = linearized
        A = A + information
        delta: FloatArray = np.linalg.solve(A, b - information @ correction).astype(np.float64)
        guess = guess @ se3.exp_one(delta)
        correction = correction + delta  # to first order in the turn, which is small
        if delta @ A @ delta < SMALL_STEP**2:
            break
    return guess


class _KnownLandmarks:
    """Observations of known landmarks in one frame; coordinates are the first axis, as in `geometry.stereo_camera`."""

    def __init__(self, problem: Problem, points: FloatArray, pixel: FloatArray) -> None:
        self._points, self._model = np.ascontiguousarray(points.T), problem.measurement
        self._measured = problem.measurement.rows_of(pixel).T
        cam_T_imu = se3.inverse(problem.sequence.imu_T_cam)
        self._rotation, self._translation = cam_T_imu[:3, :3], cam_T_imu[:3, 3:]
        self._by_turn = self._rotation @ hat3(np.eye(3))  # [k] (3, 3): derivative by w of a point e_k in the IMU frame
        self._along = np.empty((3, 6, len(points)))
        self._along[:, :3] = -self._rotation[:, :, None]

    def linearize(self, pose: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Normal equations J^T W J (6, 6) and J^T W r (6,) for a perturbation of the pose, weighted by noise and
        kernel, of the points in front of the camera; None if none is."""
        model, along = self._model, self._along
        point = pose[:3, :3].T @ (self._points - pose[:3, 3:])
        # T exp(delta) moves the point s in the IMU frame by [-I, hat(s)] delta.
        np.einsum("kij,kn->ijn", self._by_turn, point, out=along[:, 3:])
        with np.errstate(divide="ignore", invalid="ignore"):  # at the camera's plane
            seen = model.camera.rows(self._rotation @ point + self._translation)
            J = model.camera.row_derivatives(seen, along)
            front = 1.0 / seen.inverse_z > model.camera.min_depth
        if not front.all():
            if not front.any():
                return None
            J[:, :, ~front] = 0.0
        white = model.whitening_scale[:, None]
        residual = np.where(front, (self._measured - seen.pixel) * white, 0.0)
        root = np.sqrt(model.weight(np.einsum("in,in->n", residual, residual)))
        J *= (white * root)[:, None]
        residual *= root
        rows = J.transpose(1, 0, 2).reshape(6, -1)
        return rows @ rows.T, rows @ residual.ravel()
