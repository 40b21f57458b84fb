"""The rigid motion that lays one path over another."""

import numpy as np

from fgbaseline.geometry import FgbaselineError, FloatArray


def align_se3(positions: FloatArray, reference: FloatArray) -> FloatArray:
    """`reference_T_estimate` (4, 4) that minimises the squared distances of paired positions (n, 3), m.

    Closed form of Umeyama (1991) without scale; never a reflection. Where the positions leave directions free (all on
    a line, or one point) it is one of the equally good answers. Raises FgbaselineError for no pairs or NaN.
    """
    if len(positions) == 0 or positions.shape != reference.shape:
        raise FgbaselineError(f"alignment needs paired positions, got {positions.shape} and {reference.shape}")
    if not (np.isfinite(positions).all() and np.isfinite(reference).all()):
        raise FgbaselineError("alignment needs finite positions")
    centre, reference_centre = positions.mean(axis=0), reference.mean(axis=0)
    covariance = (reference - reference_centre).T @ (positions - centre)
    U, _, Vt = np.linalg.svd(covariance)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    T = np.eye(4)
    T[:3, :3] = U @ sign @ Vt
    T[:3, 3] = reference_centre - T[:3, :3] @ centre
    return T
