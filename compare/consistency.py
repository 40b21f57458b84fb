"""Whether a covariance tells the truth about the error it stands for."""

import numpy as np

from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, se3


def nees(estimate: Estimate, truth: Truth) -> FloatArray:
    """(T,) normalised estimation error squared e^T P^-1 e of each pose, e = log(T^-1 T_true) in the body frame, [v, w].

    6 on average for a filter that knows its errors. NaN where there is no truth, no pose or no positive definite
    covariance (the first pose, which is held). Bar-Shalom, Li and Kirubarajan (2001), section 5.4.
    """
    result = np.full(len(estimate.world_T_imu), np.nan)
    if estimate.covariance is None:
        return result
    finite = truth.known & np.isfinite(estimate.world_T_imu).all(axis=(1, 2))
    finite &= np.isfinite(estimate.covariance).all(axis=(1, 2))
    k = np.flatnonzero(finite)
    P = estimate.covariance[k]
    eigenvalues = np.linalg.eigvalsh(0.5 * (P + np.swapaxes(P, 1, 2)))
    positive = eigenvalues[:, 0] > MIN_EIGENVALUE
    k, P = k[positive], P[positive]
    error = se3.log(se3.inverse(estimate.world_T_imu[k]) @ truth.world_T_imu[k])
    result[k] = np.einsum("ti,ti->t", error, np.linalg.solve(P, error[:, :, None])[:, :, 0])
    return result


MIN_EIGENVALUE = 1e-11
"""m^2 or rad^2: below it a pose is held, and has no error to speak of"""
