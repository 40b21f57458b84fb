"""Normalized innovation squared (NIS) of a frame, for the consistency of a filter.

nu^T S^-1 nu is taken over the three rows (uL, uR, (vL + vR) / 2) of all observations at once, with their correlations.
For a consistent filter it is chi-square with 3n degrees of freedom (Bar-Shalom, Li and Kirubarajan 2001, section 5.4).
It is computed before kernel and gate: rejected innovations are evidence as well.
"""

import numpy as np

from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement_model import STEREO_ROWS

from .pose_update import PoseInnovation, PosePosterior, pose_posterior


def decoupled_nis(innovation: PoseInnovation, covariance: FloatArray) -> float:
    """NIS of the decoupled filter, which treats landmarks as known: S = H Sigma H^T + R with the pose covariance Sigma.

    NaN where it is not finite.
    """
    try:
        posterior = pose_posterior(covariance, innovation, np.ones(len(innovation.residual)))
    except np.linalg.LinAlgError:
        return float("nan")
    return three_row_nis(posterior, innovation)


def three_row_nis(posterior: PosePosterior, innovation: PoseInnovation) -> float:
    """NIS over the three rows, from a pose update in which every observation had weight 1.

    The squared norm of the printed four rows is larger by (vL - vR)^2 / (2 V), which does not depend on the state.
    """
    if innovation.residual.shape[1] == len(STEREO_ROWS):
        return posterior.nis
    apart = innovation.residual[:, 1] - innovation.residual[:, 3]
    return posterior.nis - 0.5 * float(apart @ apart) / float(innovation.variance[1])
