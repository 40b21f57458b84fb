"""Pose covariances carried along with the poses: to another body, into another world, from another start.

A covariance is of the right perturbation, T exp(hat(e)), e = [v, w] in the frame of the body.
"""

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from .nees import HELD, is_positive_definite

MOSTLY = 0.5
"""of the poses: where the covariances of so many grow from that of the first pose, they are of the motion since it"""


def of_other_body(covariance: FloatArray, body_T_other: FloatArray) -> FloatArray:
    """Covariances (n, 6, 6) of poses `world_T_body` as those of `world_T_other`: by the adjoint of `other_T_body`."""
    A = se3.adjoint(se3.inverse(body_T_other))
    return np.asarray(A @ covariance @ A.T)


def scaled(covariance: FloatArray, scale: float) -> FloatArray:
    """Covariances (n, 6, 6) of poses whose positions are multiplied by `scale`.

    That is all that an alignment changes: the motion of a world acts on the left of a pose, its perturbation is on the
    right.
    """
    s = np.repeat([scale, 1.0], 3)
    return np.asarray(s[:, None] * covariance * s)


def since_first(poses: FloatArray, covariance: FloatArray) -> FloatArray | None:
    """Covariances (n, 6, 6) of the motions since the first of poses (n, 4, 4); None where they are not of that kind.

    P_k - A_k P_0 A_k^T, A_k the adjoint of T_k^-1 T_0: what dead reckoning from an uncertain start has gained. Of the
    first pose it is zero. Covariances are of that kind where this is positive definite for MOSTLY of the other poses;
    those of absolute positions are not.
    """
    first = covariance[:1]
    if not np.isfinite(first).all() or not (np.abs(first).max() <= HELD or is_positive_definite(first)[0]):
        return None
    A = se3.adjoint(se3.inverse(poses) @ poses[0])
    D = covariance - A @ covariance[0] @ np.swapaxes(A, 1, 2)
    D[0] = 0.0
    known = np.isfinite(D).all(axis=(1, 2))
    known[0] = False
    return D if known.any() and is_positive_definite(D[known]).mean() >= MOSTLY else None
