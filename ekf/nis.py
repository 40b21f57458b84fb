"""The normalized innovation squared of a frame: how large what it saw was beside what the filter expected.

nu^T S^-1 nu over the three rows (uL, uR, (vL + vR) / 2) of all observations at once, with their correlations: for a
filter that knows its errors it is chi-square with 3n degrees of freedom (Bar-Shalom, Li and Kirubarajan 2001, section
5.4). Neither kernel nor gate takes part: an innovation that the filter throws away is evidence all the same.
"""

import numpy as np

from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.measurement import ROWS

from .pose_update import PoseInnovation, PosePosterior, pose_posterior


def decoupled_nis(innovation: PoseInnovation, covariance: FloatArray) -> float:
    """The same of landmarks that count as known, as in the documented filter: S = H Sigma H^T + R, Sigma the pose's.

    NaN where it is not finite.
    """
    try:
        posterior = pose_posterior(covariance, innovation, np.ones(len(innovation.residual)))
    except np.linalg.LinAlgError:
        return float("nan")
    return three_row_nis(posterior, innovation)


def three_row_nis(posterior: PosePosterior, innovation: PoseInnovation) -> float:
    """That of a pose update in which every observation had its full weight.

    Of the printed four rows' squared norm, (vL - vR)^2 / (2 V) is the same whatever the state.
    """
    if innovation.residual.shape[1] == len(ROWS):
        return posterior.nis
    apart = innovation.residual[:, 1] - innovation.residual[:, 3]
    return posterior.nis - 0.5 * float(apart @ apart) / float(innovation.variance[1])
