"""The normalised innovation squared of a frame: how large what it saw was beside what the filter expected.

nu^T S^-1 nu over the three rows (uL, uR, (vL + vR) / 2) of all observations at once, with their correlations: for a
filter that knows its errors it is chi-square with 3n degrees of freedom (Bar-Shalom, Li and Kirubarajan 2001, section
5.4). Neither kernel nor gate takes part: an innovation that the filter throws away is evidence all the same.
"""

import numpy as np

from fgbaseline.geometry import FloatArray

from .pose_update import PoseInnovation


def squared_norm_of_known(innovation: PoseInnovation, covariance: FloatArray, pixel_variance: float) -> float:
    """The same of landmarks that count as known, as in the documented filter: S = H Sigma H^T + R, Sigma the pose's.

    It is the least value of |B x - y|^2 + |x|^2 with Sigma = L L^T, B = R^-1/2 H L and y = R^-1/2 nu, which stays
    accurate where a landmark near the camera plane makes S numerically singular. NaN where it is not finite.
    """
    H, nu = innovation.jacobian, innovation.residual
    both = np.sqrt(0.5)  # of vL and vR, for which H is the same: their sum over sqrt 2 has the variance of one row
    rows = np.stack([H[:, 0], H[:, 2], both * (H[:, 1] + H[:, 3])], axis=1).reshape(-1, 6)
    seen = np.stack([nu[:, 0], nu[:, 2], both * (nu[:, 1] + nu[:, 3])], axis=1).reshape(-1)
    try:
        B = rows @ np.linalg.cholesky(covariance) / np.sqrt(pixel_variance)
        A, y = np.vstack([B, np.eye(6)]), np.concatenate([seen / np.sqrt(pixel_variance), np.zeros(6)])
        left = y - A @ np.linalg.lstsq(A, y, rcond=0.0)[0]
    except np.linalg.LinAlgError:
        return float("nan")
    return float(left @ left)
