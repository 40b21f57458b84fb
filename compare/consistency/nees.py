"""Normalized estimation error squared (NEES) of poses (Bar-Shalom, Li and Kirubarajan, 2001, section 5.4).

The error of a pose X is e = log(X^-1 X_true), the right perturbation [v, w] (m, rad) in the body frame of the estimated
pose, to which the covariance belongs. No alignment precedes it: estimate and truth agree on the first pose, or with raw
inertial samples on its position and heading (see `state_nees`).
"""

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, se3

from ..statistics.chi_square import mahalanobis_squared, share_inside_bounds
from ..statistics.descriptive import without_nan
from .covariance import CovarianceState, covariance_state

PARTS = {"position": slice(0, 3), "rotation": slice(3, 6)}


def body_error(estimate: Estimate, other: Truth | Estimate) -> FloatArray:
    """Errors e = log(X^-1 X_other), shape (n_frames, 6), [v, w] in m and rad, in the estimated body frames.

    X is the pose of `estimate`, X_other that of the truth or of another estimate; NaN where either is missing.
    """
    X, X_other = estimate.world_T_imu, other.world_T_imu
    error = np.full((len(X), 6), np.nan)
    k = np.flatnonzero(np.isfinite(X).all(axis=(1, 2)) & np.isfinite(X_other).all(axis=(1, 2)))
    error[k] = se3.log(se3.inverse(X[k]) @ X_other[k])
    return error


def nees(estimate: Estimate, truth: Truth) -> FloatArray:
    """NEES e^T P^-1 e, shape (n_frames,), with the pose error e = log(X^-1 X_true) of `body_error`.

    Its mean is 6 for a consistent estimator. NaN without truth, pose or positive definite covariance, as of the first
    pose, which is fixed. Bar-Shalom, Li and Kirubarajan (2001), section 5.4.
    """
    return nees_table(estimate, truth)["pose"].to_numpy()


def nees_table(estimate: Estimate, truth: Truth) -> pd.DataFrame:
    """NEES of the `pose` (6 degrees of freedom), `position` and `rotation` (3 each), by frame; NaN as in `nees`."""
    table = pd.DataFrame(
        np.nan, index=pd.RangeIndex(len(estimate.world_T_imu), name="frame"), columns=["pose", *PARTS], dtype=np.float64
    )
    k = np.flatnonzero((covariance_state(estimate) == CovarianceState.POSITIVE_DEFINITE) & truth.known)
    if estimate.covariance is None or len(k) == 0:
        return table
    error, P = body_error(estimate, truth)[k], estimate.covariance[k]
    table.loc[k, "pose"] = mahalanobis_squared(error, P)
    for name, part in PARTS.items():
        table.loc[k, name] = mahalanobis_squared(error[:, part], P[:, part, part])
    return table


def nees_summary(values: FloatArray, degrees: float = 6.0) -> dict[str, float | int]:
    """Mean, median, share `inside_95` the bounds of a single value and number of `frames` of a NEES (T,) without NaN.

    The statistics are NaN where every frame is. `degrees`: expected mean, the degrees of freedom of the error.
    """
    known = without_nan(values)
    return {
        "mean": float(np.mean(known)) if len(known) else np.nan,
        "median": float(np.median(known)) if len(known) else np.nan,
        "inside_95": share_inside_bounds(known, degrees),
        "frames": len(known),
    }


def sigma_ratio(estimate: Estimate, reference: Estimate) -> pd.DataFrame:
    """Ratio of an estimate's sigma to the reference's, one row per frame: `position` and `rotation`.

    sqrt(tr P / tr P_ref) of the 3x3 blocks. Each block is in its own body frame, on which a trace does not depend. A
    consistent filter has at least 1 against a smoother of the same data; below 1 the filter is overconfident. NaN where
    either has no positive definite covariance.
    """
    table = pd.DataFrame(
        np.nan, index=pd.RangeIndex(len(estimate.world_T_imu), name="frame"), columns=list(PARTS), dtype=np.float64
    )
    valid = [covariance_state(e) == CovarianceState.POSITIVE_DEFINITE for e in (estimate, reference)]
    k = np.flatnonzero(valid[0] & valid[1])
    if estimate.covariance is not None and reference.covariance is not None:
        for name, part in PARTS.items():
            P, P_ref = (np.einsum("tii->t", c[k, part, part]) for c in (estimate.covariance, reference.covariance))
            table.loc[k, name] = np.sqrt(P / P_ref)
    return table
