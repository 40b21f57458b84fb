"""NEES of the difference from a reference on the same data, whose covariance is P - P_ref."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Estimate
from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, se3

from ..statistics.chi_square import mahalanobis_squared
from .covariance import CovarianceState, covariance_state, is_positive_definite
from .nees import body_error

NEGLIGIBLE = 1e-6
"""ratio of the variance of P - P_ref to that of P, in a direction, up to which it counts as zero"""
SMALLER = 0.1
"""ratio of the variance of P_ref - P to that of P, in some direction, above which a pose is overconfident"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ReferenceNees(Displayed):
    """NEES of the difference of an estimate from the reference."""

    nees: FloatArray
    """d^T (P - P_ref)^-1 d (T,); NaN where it is undefined"""
    comparable: BoolArray
    """frames (T,) in which both have a pose and a positive definite covariance"""
    overconfident: BoolArray
    """comparable frames (T,) in which P is smaller than P_ref in some direction, although P_ref is from no less data"""

    @property
    def is_overconfident(self) -> bool:
        """Whether most of the comparable frames are overconfident."""
        return bool(2 * self.overconfident.sum() > self.comparable.sum())

    @property
    def left_out(self) -> BoolArray:
        """Comparable frames (T,) in which P - P_ref is not positive definite."""
        return np.asarray(self.comparable & np.isnan(self.nees), dtype=np.bool_)


def reference_nees(estimate: Estimate, reference: Estimate) -> ReferenceNees:
    """NEES of d = log(T^-1 T_ref), in the body frame of the estimate, with the covariance of the difference.

    A filter and the smoother use the same data, so their errors are correlated. Under one linear Gaussian model the
    smoother's error is uncorrelated with the difference d, and cov(d) = P - P_ref (Rauch, Tung and Striebel, 1965).
    P_ref is transformed to the frame of the estimate's pose. Frames in which P - P_ref is not positive definite, where
    the two do not share one model, are `left_out`. The mean is 6 for a filter that is consistent with the reference;
    errors common to both do not show.
    """
    T = len(estimate.world_T_imu)
    valid = [covariance_state(e) == CovarianceState.POSITIVE_DEFINITE for e in (estimate, reference)]
    both = np.asarray(valid[0] & valid[1], dtype=np.bool_)
    result = ReferenceNees(np.full(T, np.nan), both, np.zeros(T, dtype=np.bool_))
    k = np.flatnonzero(result.comparable)
    if estimate.covariance is None or reference.covariance is None or len(k) == 0:
        return result
    d = body_error(estimate, reference)[k]
    P, J = estimate.covariance[k], se3.inverse_right_jacobian(d)
    P_ref = J @ reference.covariance[k] @ np.swapaxes(J, 1, 2)
    difference, share = _difference_and_share(P, P_ref)
    result.overconfident[k] = share < -SMALLER
    positive = np.isfinite(difference).all(axis=(1, 2))
    result.nees[k[positive]] = mahalanobis_squared(d[positive], difference[positive])
    return result


def difference_covariance(P: FloatArray, P_ref: FloatArray) -> FloatArray:
    """Difference P - P_ref (n, d, d) of positive definite covariances; NaN where it is not positive definite.

    The eigenvalues of L^-1 (P - P_ref) L^-T with P = L L^T decide: each is the share of the filter's variance that
    the reference removes in a direction. A share up to `NEGLIGIBLE` counts as zero.
    """
    return _difference_and_share(P, P_ref)[0]


def _difference_and_share(P: FloatArray, P_ref: FloatArray) -> tuple[FloatArray, FloatArray]:
    """P - P_ref (n, d, d), NaN where not positive definite, and its `smallest_share` (n,)."""
    P, P_ref = 0.5 * (P + np.swapaxes(P, 1, 2)), 0.5 * (P_ref + np.swapaxes(P_ref, 1, 2))
    difference, share = P - P_ref, smallest_share(P, P_ref)
    difference[~((share > NEGLIGIBLE) & is_positive_definite(difference))] = np.nan
    return np.asarray(difference, dtype=np.float64), share


def smallest_share(P: FloatArray, P_ref: FloatArray) -> FloatArray:
    """Smallest eigenvalue (n,) of L^-1 (P - P_ref) L^-T with P = L L^T, the filter's covariances (n, d, d)."""
    inverse = np.linalg.inv(np.linalg.cholesky(P))
    shares = np.linalg.eigvalsh(inverse @ (P - P_ref) @ np.swapaxes(inverse, 1, 2))
    return np.asarray(shares[:, 0], dtype=np.float64)
