"""Chi-square gating of innovations: rejected frames, rejected observations and robust weights of the joint filter.

A frame of which most observations disagree with the prediction is rejected as a whole; `process_noise` says what
becomes of successive ones.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import chdtri

from fgbaseline.data.estimators.estimate import EventKind
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, MeasurementModel

from .settings import JointSettings

OUTLIER_PROBABILITY = 1.0 - 1e-6
"""Chi-square probability (5.5 sigma) beyond which an observation counts as an outlier for the rejection of its frame.
With noise of twice the modeled sigma, 5 % of the correct matches do."""
MIN_VOTES = 5
"""Smallest number of observations for which a frame can be rejected as a whole."""


@dataclass(frozen=True, eq=False, slots=True)
class GatedObservations:
    """Result of gating n observations."""

    accepted: BoolArray
    """(n,) mask of the observations to use"""
    weight: FloatArray
    """(n,) kernel weights: factors on the inverse of each observation's noise"""
    rejection: EventKind | None = None
    """reason for the rejection of observations that are not accepted; None if all are"""

    @property
    def order(self) -> IntArray:
        """Indices (n,): first the accepted observations with weight 1, then the other accepted ones, then the rest."""
        return np.argsort(np.where(self.accepted, self.weight != 1.0, 2), kind="stable")


def gate_observations(nis: FloatArray, measurement: MeasurementModel, settings: JointSettings) -> GatedObservations:
    """Gate observations by their `nis` (n,), each innovation whitened by its own covariance.

    Where more than `disagreeing_share` of a frame's observations are outliers, all are rejected: the few inliers agree
    by chance.
    """
    n = len(nis)
    weight = measurement.weight(nis)
    if settings.disagreeing_share is not None and n >= MIN_VOTES:
        disagreeing = np.count_nonzero(~(nis <= chi2_quantile(OUTLIER_PROBABILITY, measurement.n_rows)))
        if disagreeing > settings.disagreeing_share * n:
            return GatedObservations(np.zeros(n, dtype=np.bool_), weight, EventKind.FRAME_DISAGREES)
    if settings.gate is not None:
        accepted = nis <= chi2_quantile(settings.gate, measurement.n_rows)
        return GatedObservations(accepted, weight, None if accepted.all() else EventKind.OUTSIDE_GATE)
    return GatedObservations(np.ones(n, dtype=np.bool_), weight)


@cache
def chi2_quantile(probability: float, degrees: int) -> float:
    """Chi-square quantile with the degrees of freedom of one observation, 3 or 2."""
    return float(chdtri(degrees, 1.0 - probability))
