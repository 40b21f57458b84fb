"""Standard deviation of the positions and rotations of an estimate, by its own covariances, in m and degrees."""

from dataclasses import dataclass

import numpy as np

from fgbaseline.data import Estimate
from fgbaseline.data.display import Displayed
from fgbaseline.geometry import FloatArray

from .covariance import CovarianceState, covariance_state


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class PoseSigma(Displayed):
    """1-sigma of each pose under the noise model of the problem, with the first pose fixed.

    A covariance (6, 6) is that of the right perturbation [v, w]. A rotation of axes leaves the trace of a block
    unchanged, so the square root of a trace is the standard deviation of the vector in any frame.
    """

    position: FloatArray
    """(T,) m, square root of the trace of the position block; NaN where a pose has no valid covariance"""
    rotation_deg: FloatArray
    """(T,) degrees, of the rotation block"""

    @property
    def position_rmse(self) -> float:
        """RMS of the position sigma along the path, m."""
        return _rms(self.position)

    @property
    def position_final(self) -> float:
        """Position sigma of the last pose with a covariance, m."""
        return _last(self.position)

    @property
    def rotation_rmse_deg(self) -> float:
        """RMS of the rotation sigma along the path, degrees."""
        return _rms(self.rotation_deg)

    @property
    def rotation_final_deg(self) -> float:
        """Rotation sigma of the last pose with a covariance, degrees."""
        return _last(self.rotation_deg)


def pose_sigma(estimate: Estimate) -> PoseSigma:
    """1-sigma of the poses of an estimate; all NaN where it has no covariances. A fixed pose has zero."""
    T = len(estimate.world_T_imu)
    sigma = np.full((T, 2), np.nan)
    state = covariance_state(estimate)
    if estimate.covariance is not None:
        k = np.flatnonzero(np.isin(state, (CovarianceState.POSITIVE_DEFINITE, CovarianceState.PARTLY_HELD)))
        variance = np.einsum("nii->ni", estimate.covariance[k])
        sigma[k] = np.sqrt(np.stack([variance[:, :3].sum(axis=1), variance[:, 3:].sum(axis=1)], axis=1))
        sigma[state == CovarianceState.HELD] = 0.0
    return PoseSigma(sigma[:, 0], np.degrees(sigma[:, 1]))


def _rms(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _last(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known[-1]) if len(known) else float("nan")
