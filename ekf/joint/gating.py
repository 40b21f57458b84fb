"""Chi-square gating of innovations: rejected frames, rejected observations and robust weights of the joint filter.

A frame of which most observations disagree with the prediction has wrong matches, or the prediction is wrong. The
innovations of one frame share the error of the prediction, so their number does not decide between the two. Whether
they agree with each other does: each is compared with its prediction from all others, with more noise in the motion
(`motion_noise_factor`, `Innovation.nis_given_others`).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import chdtri

from fgbaseline.data.estimate import EventKind
from fgbaseline.data.observations import BoolArray, IntArray
from fgbaseline.geometry import FloatArray, StereoMeasurement
from fgbaseline.geometry.measurement import squared_norm

from .settings import JointSettings

OUTLIER_PROBABILITY = 1.0 - 1e-6
"""Chi-square probability (5.5 sigma) beyond which an observation counts as an outlier for the rejection of its frame.
With noise of twice the modeled sigma, 5 % of the correct matches do."""
MIN_VOTES = 5
"""Smallest number of observations for which a frame can be rejected as a whole."""
MAX_REJECTED = 10
"""Successive rejected frames (1 s at 10 Hz) after which the landmarks are given up and new ones are initialized."""
MAX_DOUBLINGS = 100
"""Doublings of the motion noise that `motion_noise_factor` tries."""


@dataclass(frozen=True, eq=False, slots=True)
class GatedObservations:
    """Result of gating n observations."""

    accepted: BoolArray
    """(n,) mask of the observations to use"""
    weight: FloatArray
    """(n,) kernel weights: factors on the inverse of each observation's noise"""
    rejection: EventKind | None = None
    """reason for which the others are rejected"""

    @property
    def order(self) -> IntArray:
        """Indices (n,): first the accepted observations with weight 1, then the other accepted ones, then the rest."""
        return np.argsort(np.where(self.accepted, self.weight != 1.0, 2), kind="stable")


def gate_observations(
    squared_norm: FloatArray, measurement: StereoMeasurement, settings: JointSettings
) -> GatedObservations:
    """Gate observations by their NIS (n,), each innovation whitened by its own covariance.

    Where more than `disagreeing_share` of a frame's observations are outliers, all are rejected: the few inliers agree
    by chance.
    """
    n = len(squared_norm)
    weight = measurement.weight(squared_norm)
    if settings.disagreeing_share is not None and n >= MIN_VOTES:
        disagreeing = np.count_nonzero(~(squared_norm <= chi2_quantile(OUTLIER_PROBABILITY, measurement.n_rows)))
        if disagreeing > settings.disagreeing_share * n:
            return GatedObservations(np.zeros(n, dtype=np.bool_), weight, EventKind.FRAME_DISAGREES)
    if settings.gate is not None:
        accepted = squared_norm <= chi2_quantile(settings.gate, measurement.n_rows)
        return GatedObservations(accepted, weight, None if accepted.all() else EventKind.OUTSIDE_GATE)
    return GatedObservations(np.ones(n, dtype=np.bool_), weight)


def motion_noise_factor(residual: FloatArray, covariance: FloatArray, of_motion: FloatArray) -> float | None:
    """Smallest power of two f for which the median NIS under `covariance` + f `of_motion` is that of chi-square.

    The arrays are innovations (n, r), px, their covariances (n, r, r), px^2, and the parts of these that come from the
    noise of the motion. None where no f suffices: the noise is singular, or a residual is not finite.
    """
    median = chi2_quantile(0.5, residual.shape[1])
    for doubling in range(MAX_DOUBLINGS):
        factor = 2.0**doubling
        if np.median(squared_norm(residual, covariance + factor * of_motion)) <= median:
            return factor
    return None


@cache
def chi2_quantile(probability: float, degrees: int) -> float:
    """Chi-square quantile with the degrees of freedom of one observation, 3 or 2."""
    return float(chdtri(degrees, 1.0 - probability))
