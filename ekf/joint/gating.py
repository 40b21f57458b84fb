"""Which of a frame's observations the joint filter believes, and how much."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import chdtri

from fgbaseline.data.estimate import EventKind
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, StereoMeasurement
from fgbaseline.geometry.measurement import ROWS

from .settings import JointSettings

DISAGREEMENT = 1.0 - 1e-6
"""chi-square probability (5.5 sigma) beyond which an observation disagrees, when it is asked whether a whole frame
does: so far out that noise assumed too small by half does not silence the filter, and matches that are wrong do"""
MIN_VOTES = 5
"""observations below which a frame has no majority"""


@dataclass(frozen=True, eq=False, slots=True)
class GatedObservations:
    """The verdict on n observations."""

    accepted: BoolArray
    """(n,)"""
    weight: FloatArray
    """(n,) the kernel's, by which the inverse of each one's noise is multiplied"""
    rejection: EventKind | None = None
    """why the others are not taken"""

    @property
    def full_weight(self) -> bool:
        """Whether all are taken with their full weight."""
        return bool(self.accepted.all() and (self.weight == 1.0).all())


def gate_observations(
    squared_norm: FloatArray, measurement: StereoMeasurement, settings: JointSettings
) -> GatedObservations:
    """The verdict on observations whose innovations have squared norms (n,), whitened by their own covariance.

    A burst of bad matches costs its frame's matches: where most of them disagree none is believed, since the few that
    agree do so by chance.
    """
    n = len(squared_norm)
    weight = measurement.weight(squared_norm)
    if settings.disagreeing_share is not None and n >= MIN_VOTES:
        disagreeing = np.count_nonzero(~(squared_norm <= chi2_quantile(DISAGREEMENT)))
        if disagreeing > settings.disagreeing_share * n:
            return GatedObservations(np.zeros(n, dtype=np.bool_), weight, EventKind.FRAME_DISAGREES)
    if settings.gate is not None:
        accepted = squared_norm <= chi2_quantile(settings.gate)
        return GatedObservations(accepted, weight, None if accepted.all() else EventKind.OUTSIDE_GATE)
    return GatedObservations(np.ones(n, dtype=np.bool_), weight)


@cache
def chi2_quantile(probability: float) -> float:
    """The chi-square quantile with the degrees of freedom of one observation."""
    return float(chdtri(len(ROWS), 1.0 - probability))
