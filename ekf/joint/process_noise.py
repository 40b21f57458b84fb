"""Inflation of the process noise where successive frames disagree with the prediction and not in themselves.

A frame of which most observations disagree with the prediction has wrong matches, or the prediction is wrong. The
innovations of one frame share the error of the prediction, so their number does not decide between the two. Whether
they agree with each other does: each is compared with its prediction from all others, with more noise in the motion
(`Innovation.nis_given_others`).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fgbaseline.data.estimators.estimate import EventKind
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement_model import mahalanobis_squared

from ..motion_model import POSE, PredictedState
from .gating import GatedObservations, chi2_quantile
from .update import Innovation, NotPositiveDefiniteError

MAX_REJECTED = 10
"""Consecutive rejected frames (1 s at 10 Hz) after which the landmarks are marginalized and new ones initialized."""
MAX_DOUBLINGS = 100
"""Doublings of the noise that `inflation_factor` tries."""


class InflatedInnovation(NamedTuple):
    """Innovation of a frame under inflated process noise, with its gating."""

    innovation: Innovation
    gated: GatedObservations
    factor: float
    """multiple of the accumulated process noise that P has in addition"""


class ProcessNoise:
    """Process noise accumulated since the last accepted frame, and the frames rejected as a whole since then."""

    def __init__(self, n: int) -> None:
        self._accumulated = np.zeros((n, n))
        """covariance that the motion alone has added to the body state"""
        self.n_rejected = 0
        """number of consecutive frames rejected as a whole"""

    def propagate(self, prediction: PredictedState) -> None:
        """Accumulate the noise of one interval: propagated by F, plus Q."""
        self._accumulated = prediction.covariance(self._accumulated)

    def reset(self) -> None:
        """Begin anew at an accepted frame."""
        self._accumulated = np.zeros_like(self._accumulated)
        self.n_rejected = 0

    def inflate(
        self,
        innovation: Innovation,
        P: FloatArray,
        variance: FloatArray,
        gate: Callable[[FloatArray], GatedObservations],
    ) -> InflatedInnovation | None:
        """Inflate P (size, size), in place, by a multiple of the accumulated noise under which `gate` accepts a frame.

        `innovation` is that of the rejected frame, `variance` (n, r) or (r,) its R, px^2. None, with P unchanged, if
        the frame is still rejected.
        """
        n, pose = len(self._accumulated), innovation.H.pose_jacobian
        by_motion = pose @ self._accumulated[:POSE, :POSE] @ np.swapaxes(pose, 1, 2)
        factor = inflation_factor(innovation.residual, innovation.own_covariances(variance), by_motion)
        if factor is None:
            return None
        before = P[:n, :n].copy()
        P[:n, :n] += factor * self._accumulated
        inflated = Innovation.of(innovation.H, innovation.residual, P)
        try:
            gated = gate(inflated.nis_given_others(variance))
        except NotPositiveDefiniteError:
            gated = None
        if gated is None or gated.rejection is EventKind.FRAME_DISAGREES:
            P[:n, :n] = before
            return None
        return InflatedInnovation(inflated, gated, factor)


def inflation_factor(residual: FloatArray, covariance: FloatArray, by_motion: FloatArray) -> float | None:
    """Smallest power of two f for which the median NIS under `covariance` + f `by_motion` is that of chi-square.

    The arrays are innovations (n, r), px, their covariances (n, r, r), px^2, and the parts of these that come from the
    process noise. None where no f suffices: the noise is singular, or a residual is not finite.
    """
    median = chi2_quantile(0.5, residual.shape[1])
    for doubling in range(MAX_DOUBLINGS):
        factor = 2.0**doubling
        if np.median(mahalanobis_squared(residual, covariance + factor * by_motion)) <= median:
            return factor
    return None
