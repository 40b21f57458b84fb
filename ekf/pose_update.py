"""Measurement update of the pose with known landmarks (equation 13).

A body state with further components after the pose has the Jacobian of the pose, padded with zeros.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgeqp3, dormqr, dtrtrs

from fgbaseline.geometry import FloatArray, MeasurementModel
from fgbaseline.geometry.linearization import predict
from fgbaseline.geometry.measurement_model import mahalanobis_squared

from .motion_model import POSE


class PoseInnovation(NamedTuple):
    """Innovation of n observations of known landmarks, r rows each, with its Jacobian w.r.t. the pose."""

    residual: FloatArray
    """(n, r) z - z~, px"""
    jacobian: FloatArray
    """(n, r, 6) of the predicted rows by the right perturbation [v, w] of the pose: H of equation 13"""
    variance: FloatArray
    """(r,) of each row, px^2"""

    def nis_per_observation(self, covariance: FloatArray) -> FloatArray:
        """NIS (n,) of each observation alone, r^T (H Sigma H^T + V)^-1 r, for three rows and a Sigma (n, n)."""
        H = self.jacobian
        return mahalanobis_squared(
            self.residual, H @ covariance[:POSE, :POSE] @ np.swapaxes(H, 1, 2) + np.diag(self.variance)
        )


def pose_innovation(
    measurement: MeasurementModel,
    cam_T_imu: FloatArray,
    world_T_imu: FloatArray,
    points: FloatArray,
    pixel: FloatArray,
) -> PoseInnovation:
    """Innovation of world points (n, 3) observed at pixels (n, 4) from a pose (4, 4) (equation 13).

    Its rows are those of `MeasurementModel.documented_innovation`.
    """
    predicted = predict(measurement.camera, cam_T_imu, world_T_imu, points)
    residual, rows, variance = measurement.documented_innovation(pixel, predicted.pixel)
    return PoseInnovation(residual, predicted.pose_jacobian()[:, rows], variance)


class PosePosterior(NamedTuple):
    """Posterior of a body state with an error of n components (equation 13)."""

    correction: FloatArray
    """(n,) K (z - z~), the error to apply to the predicted body state"""
    covariance: FloatArray
    """(n, n) (I - K H) Sigma"""
    innovation_condition: float
    """the condition number of H Sigma H^T + I (x) V, whose inverse the printed equation asks for"""
    nis: float
    """(z - z~)^T (H Sigma H^T + V)^-1 (z - z~), over all rows of each observation"""


def pose_posterior(covariance: FloatArray, innovation: PoseInnovation, weight: FloatArray) -> PosePosterior:
    """Pose update (equation 13) in square-root form: cost linear in the observations, positive definite result.

    With Sigma = L L^T and B = V^-1/2 H L: (I - K H) Sigma = L (I + B^T B)^-1 L^T, and L^-1 K (z - z~) is the least
    squares solution of [B; I] x = [V^-1/2 (z - z~); 0]. The QR decomposition [B; I] = Q R gives both without B^T B,
    which has no correct digit for a landmark near the camera plane. Sorting rows by size and pivoting columns make it
    row-wise stable (Cox and Higham, 1998).

    The eigenvalues of R^T R, all at least 1, are those of (H Sigma H^T + V) V^-1 that differ from 1; they give the
    condition number of the innovation covariance. The squared norm of the least-squares residual is the NIS.
    `weight` (n,) multiplies V^-1 of each observation.

    Raises numpy's LinAlgError where `covariance` is not positive definite or the innovation is not finite.
    """
    if not (np.isfinite(innovation.jacobian).all() and np.isfinite(innovation.residual).all()):
        raise np.linalg.LinAlgError("the innovation is not finite")
    L = np.linalg.cholesky(covariance)
    root = np.sqrt(weight[:, None] / innovation.variance).reshape(-1)
    n = len(L)
    stacked = np.vstack([(root[:, None] * innovation.jacobian.reshape(-1, POSE)) @ L[:POSE], np.eye(n)])
    right = np.concatenate([root * innovation.residual.reshape(-1), np.zeros(n)])
    by_size = np.argsort(-np.abs(stacked).max(axis=1), kind="stable")
    reflections, pivot, tau, _, _ = dgeqp3(np.asfortranarray(stacked[by_size]), overwrite_a=1)
    turned, _, _ = dormqr("L", "T", reflections, tau, right[by_size, None], lwork=len(right), overwrite_c=1)
    R = np.triu(reflections[:n])
    half = dtrtrs(R, L[:, pivot - 1].T, trans=1)[0].T
    correction: FloatArray = half @ turned[:n, 0]
    left = turned[n:, 0]
    return PosePosterior(correction, half @ half.T, float(np.linalg.norm(R, 2)) ** 2, float(left @ left))


def standard_form_covariance(covariance: FloatArray, innovation: PoseInnovation, weight: FloatArray) -> FloatArray:
    """Posterior covariance (n, n) as equation 13 prints it, (I - K H) Sigma, with its rounding errors.

    Raises numpy's LinAlgError where H Sigma H^T + I (x) V is singular.
    """
    n = len(covariance)
    H = np.pad(innovation.jacobian.reshape(-1, POSE), ((0, 0), (0, n - POSE)))
    noise = np.diag((innovation.variance / weight[:, None]).reshape(-1))
    gain = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + noise)
    return np.asarray((np.eye(n) - gain @ H) @ covariance, dtype=np.float64)
