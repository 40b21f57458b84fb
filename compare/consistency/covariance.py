"""Pose covariances: validity, and transformation to another body, scale or start.

A covariance (6, 6) is that of the right perturbation T exp(hat(e)), e = [v, w] in m and rad, in the body frame.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data import Estimate
from fgbaseline.geometry import FloatArray, se3

HELD = 1e-11
"""m^2 or rad^2; a covariance whose largest entry is at most this is that of a pose held fixed"""
ROUNDING = 1e-13
"""eigenvalue of a correlation matrix up to which it counts as zero"""
SEMIDEFINITE = 1e-9
"""share of the largest entry of a matrix up to which a negative eigenvalue is rounding"""
SINCE_FIRST_SHARE = 0.5
"""smallest share of positive definite P_k - A_k P_0 A_k^T, for covariances to count as grown from the first pose's"""


class CovarianceState(IntEnum):
    """Validity of a pose covariance."""

    ABSENT = 0
    """no covariance or no pose"""
    HELD = 1
    """zero: a pose that is held fixed, such as the first"""
    NOT_POSITIVE_DEFINITE = 2
    """indefinite, singular or asymmetric"""
    POSITIVE_DEFINITE = 3
    PARTLY_HELD = 4
    """first pose whose position alone is held fixed, as with raw inertial samples: it has no NEES"""


def covariance_state(estimate: Estimate) -> NDArray[np.uint8]:
    """`CovarianceState` (T,) of each pose, judged by its correlation matrix, hence independent of units."""
    state = np.zeros(len(estimate.world_T_imu), dtype=np.uint8)
    if estimate.covariance is None:
        return state
    k = np.flatnonzero(
        np.isfinite(estimate.covariance).all(axis=(1, 2)) & np.isfinite(estimate.world_T_imu).all(axis=(1, 2))
    )
    P = estimate.covariance[k]
    state[k] = np.where(
        is_positive_definite(P), CovarianceState.POSITIVE_DEFINITE, CovarianceState.NOT_POSITIVE_DEFINITE
    )
    state[k[np.abs(P).max(axis=(1, 2), initial=0.0) <= HELD]] = CovarianceState.HELD
    if (state[:1] == CovarianceState.NOT_POSITIVE_DEFINITE).any() and _has_held_position(estimate.covariance[0]):
        state[0] = CovarianceState.PARTLY_HELD
    return state


def _has_held_position(P: FloatArray) -> bool:
    """Whether a covariance (6, 6) is zero up to HELD outside of its rotation, and positive semidefinite there."""
    rotation, rest = P[3:, 3:], P.copy()
    rest[3:, 3:] = 0.0
    scale = np.abs(rotation).max()
    symmetric = np.abs(rotation - rotation.T).max() <= 1e-6 * scale
    return bool(np.abs(rest).max() <= HELD and symmetric and np.linalg.eigvalsh(rotation)[0] >= -SEMIDEFINITE * scale)


def is_positive_definite(P: FloatArray) -> NDArray[np.bool_]:
    """Whether (n,) finite matrices (n, d, d) are symmetric (to 1e-6) and positive definite beyond rounding."""
    variance = np.einsum("nii->ni", P)
    positive = (variance > 0.0).all(axis=1)
    scale = np.sqrt(np.where(positive[:, None], variance, 1.0))
    C = P / (scale[:, :, None] * scale[:, None, :])
    symmetric = np.abs(C - np.swapaxes(C, 1, 2)).max(axis=(1, 2), initial=0.0) <= 1e-6
    positive &= symmetric
    positive[positive] = np.linalg.eigvalsh(0.5 * (C + np.swapaxes(C, 1, 2))[positive])[:, 0] > ROUNDING
    return np.asarray(positive, dtype=np.bool_)


def covariance_of_body(covariance: FloatArray, body_T_other: FloatArray) -> FloatArray:
    """Covariances (n, 6, 6) of poses `world_T_body` transformed to `world_T_other` by the adjoint of `other_T_body`."""
    A = se3.adjoint(se3.inverse(body_T_other))
    return np.asarray(A @ covariance @ A.T)


def scaled_covariance(covariance: FloatArray, scale: float) -> FloatArray:
    """Covariances (n, 6, 6) of poses whose positions are multiplied by `scale`.

    Alignment changes nothing else: a motion of the world acts on the left of a pose, its perturbation on the right.
    """
    s = np.repeat([scale, 1.0], 3)
    return np.asarray(s[:, None] * covariance * s)


def covariance_since_first(poses: FloatArray, covariance: FloatArray) -> FloatArray | None:
    """Covariances (n, 6, 6) of the motions since the first of poses (n, 4, 4); None where the covariances are absolute.

    P_k - A_k P_0 A_k^T with A_k the adjoint of T_k^-1 T_0: the uncertainty that dead reckoning from an uncertain start
    adds; zero for the first pose. None where this difference is positive definite for less than SINCE_FIRST_SHARE of
    the other poses: then the covariances are of absolute positions.
    """
    first = covariance[:1]
    if not np.isfinite(first).all() or not (np.abs(first).max() <= HELD or is_positive_definite(first)[0]):
        return None
    A = se3.adjoint(se3.inverse(poses) @ poses[0])
    D = covariance - A @ covariance[0] @ np.swapaxes(A, 1, 2)
    D[0] = 0.0
    known = np.isfinite(D).all(axis=(1, 2))
    known[0] = False
    return D if known.any() and is_positive_definite(D[known]).mean() >= SINCE_FIRST_SHARE else None
