"""The difference of two estimates that rest on the same data, beside the covariance that it should have."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Estimate
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, se3

from .nees import CovarianceState, covariance_state, is_positive_definite, squared_norm

NEGLIGIBLE = 1e-6
"""of the filter's own variance: a direction in which the difference claims less has no covariance to speak of"""


@dataclass(frozen=True, eq=False, slots=True)
class DifferenceNees:
    """NEES of an estimate against the reference."""

    nees: FloatArray
    """(T,) d^T (P - P_ref)^-1 d; NaN where there is none"""
    comparable: BoolArray
    """(T,) frames in which both have a pose and a positive definite covariance"""

    @property
    def left_out(self) -> BoolArray:
        """(T,) comparable frames in which P - P_ref is not positive definite."""
        return np.asarray(self.comparable & np.isnan(self.nees), dtype=np.bool_)


def difference_nees(estimate: Estimate, reference: Estimate) -> DifferenceNees:
    """NEES of d = log(T^-1 T_ref), in the body frame of the estimate, with the covariance of the difference.

    A filter and the smoother share their data, and their errors are not independent. Under one linear Gaussian model
    the smoother's error is uncorrelated with whatever else the same data can tell, so that the filter's error is the
    smoother's plus the difference, and cov(d) = P - P_ref (Rauch, Tung and Striebel 1965). P_ref is carried into the
    frame of the estimate's pose. Where P - P_ref is not positive definite the two are not of one model; such frames are
    `left_out`. 6 on average for a filter that is consistent with the reference; whether both are wrong alike it cannot
    tell.
    """
    T = len(estimate.world_T_imu)
    sound = [covariance_state(e) == CovarianceState.POSITIVE_DEFINITE for e in (estimate, reference)]
    result = DifferenceNees(np.full(T, np.nan), np.asarray(sound[0] & sound[1], dtype=np.bool_))
    k = np.flatnonzero(result.comparable)
    if estimate.covariance is None or reference.covariance is None or len(k) == 0:
        return result
    d = se3.log(se3.inverse(estimate.world_T_imu[k]) @ reference.world_T_imu[k])
    P, J = estimate.covariance[k], se3.inverse_right_jacobian(d)
    difference = difference_covariance(P, J @ reference.covariance[k] @ np.swapaxes(J, 1, 2))
    positive = np.isfinite(difference).all(axis=(1, 2))
    result.nees[k[positive]] = squared_norm(d[positive], difference[positive])
    return result


def difference_covariance(P: FloatArray, P_ref: FloatArray) -> FloatArray:
    """P - P_ref (n, d, d) of positive definite covariances; NaN where that is not positive definite.

    Judged by the eigenvalues of L^-1 (P - P_ref) L^-T with P = L L^T: what share of the filter's variance the reference
    takes away in each direction. A share below `NEGLIGIBLE` is none.
    """
    P, P_ref = 0.5 * (P + np.swapaxes(P, 1, 2)), 0.5 * (P_ref + np.swapaxes(P_ref, 1, 2))
    difference = P - P_ref
    inverse = np.linalg.inv(np.linalg.cholesky(P))
    share = np.linalg.eigvalsh(inverse @ difference @ np.swapaxes(inverse, 1, 2))[:, 0]
    difference[~((share > NEGLIGIBLE) & is_positive_definite(difference))] = np.nan
    return np.asarray(difference, dtype=np.float64)
