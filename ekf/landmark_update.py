"""Landmark update (equations 11 and 12) on independent 3x3 blocks, for known poses.

With known poses, landmarks are conditionally independent: the 3M x 3M covariance of the source paper is block diagonal.
Each block is updated by Sigma^-1 <- Sigma^-1 + H^T V^-1 H and mu <- mu + Sigma H^T V^-1 (z - z~).

The blocks are kept as square roots R with Sigma^-1 = R^T R, updated by the QR decomposition of [V^-1/2 H; R]. The
covariance then stays positive definite for a landmark near the camera plane, whose H is unbounded.
"""

import numpy as np

from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FloatArray, MeasurementModel, se3
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.measurement_model import mahalanobis_squared
from fgbaseline.geometry.monocular_camera import require_stereo


class IndependentLandmarks:
    """Means (m, 3), m, and covariances (m, 3, 3), m^2, of m independent landmarks in the world frame."""

    def __init__(self, problem: Problem, measurement: MeasurementModel) -> None:
        m = len(problem.features)
        prior = problem.landmark_prior
        self.measurement = measurement
        self.cam_T_imu = se3.affine_inverse(problem.sequence.imu_T_cam)
        self.imu_T_cam = problem.sequence.imu_T_cam
        self.known: BoolArray = np.full(m, prior is not None)
        if prior is None:
            self.mean = np.full((m, 3), np.nan)
            self.root_information = np.zeros((m, 3, 3))
        else:
            self.mean = prior.mean.copy()
            root = np.linalg.cholesky(np.linalg.inv(prior.covariance)).T
            self.root_information = np.broadcast_to(root, (m, 3, 3)).copy()

    def update(
        self, world_T_imu: FloatArray, row: IntArray, pixel: FloatArray, weight: FloatArray | None = None
    ) -> None:
        """Update landmarks `row` (n,) with pixels (n, 4) observed from a pose (4, 4) (equations 11 and 12).

        `weight` (n,) multiplies V^-1 of each observation. Without it the kernel gives the weights, from innovations
        whitened by H Sigma H^T + V. A new landmark is initialized at its back-projection, with the information of this
        observation.
        """
        model = self.measurement
        fresh = ~self.known[row]
        if fresh.any():
            world_T_cam = world_T_imu @ self.imu_T_cam
            self.mean[row[fresh]] = se3.transform(
                world_T_cam, require_stereo(model.camera, "ekf").triangulate(pixel[fresh])
            )
            self.known[row[fresh]] = True
        predicted = predict(model.camera, self.cam_T_imu, world_T_imu, self.mean[row])
        residual, rows, variance = model.documented_innovation(pixel, predicted.pixel)
        H = predicted.point_jacobian()[:, rows, :3]
        if weight is None:
            weight = np.ones(len(row))
            if model.kernel is not None:
                weight[~fresh] = model.kernel.weight(self._squared_norms(residual[~fresh], H[~fresh], row[~fresh]))
        whiten = np.sqrt(weight[:, None] / variance)
        # The right-hand side is a fourth column, so that R contains Q^T times it and Q is never formed.
        r = len(variance)
        stacked = np.zeros((len(row), r + 3, 4))
        stacked[:, :r, :3] = whiten[:, :, None] * H
        stacked[:, :r, 3] = whiten * residual
        stacked[:, r:, :3] = self.root_information[row]
        R: FloatArray = np.asarray(np.linalg.qr(stacked, mode="r"))
        self.mean[row] += _solved(R)
        self.root_information[row] = R[:, :3, :3]

    def _squared_norms(self, residual: FloatArray, H: FloatArray, row: IntArray) -> FloatArray:
        """NIS (n,), r^T (H Sigma H^T + V)^-1 r, of residuals (n, 3) with Jacobians (n, 3, 3) of known landmarks."""
        half = np.linalg.solve(np.swapaxes(self.root_information[row], 1, 2), np.swapaxes(H, 1, 2))
        S = np.swapaxes(half, 1, 2) @ half + np.diag(self.measurement.row_variance)
        return mahalanobis_squared(residual, S)

    def covariance(self) -> FloatArray:
        """Covariances (m, 3, 3), m^2; NaN for landmarks without an observation."""
        covariance = np.full_like(self.root_information, np.nan)
        half = np.linalg.inv(self.root_information[self.known])
        covariance[self.known] = half @ np.swapaxes(half, 1, 2)
        return 0.5 * (covariance + np.swapaxes(covariance, 1, 2))


def _solved(R: FloatArray) -> FloatArray:
    """Solutions x (n, 3) of T x = c for upper triangular [T, c] (n, 3 or more, 4)."""
    x = np.empty((len(R), 3))
    x[:, 2] = R[:, 2, 3] / R[:, 2, 2]
    x[:, 1] = (R[:, 1, 3] - R[:, 1, 2] * x[:, 2]) / R[:, 1, 1]
    x[:, 0] = (R[:, 0, 3] - R[:, 0, 1] * x[:, 1] - R[:, 0, 2] * x[:, 2]) / R[:, 0, 0]
    return x
