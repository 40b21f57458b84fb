"""Whether a covariance tells the truth about the error it stands for.

The error is e = log(T^-1 T_true) (T, 6), the right perturbation [v, w] in the body frame of the estimated pose: the one
that the covariances are of. No alignment comes before it; every estimate starts at the true first pose.
"""

from collections.abc import Iterable
from enum import IntEnum

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FloatArray, se3

from .anees import nees_over_runs

PARTS = {"position": slice(0, 3), "rotation": slice(3, 6)}
HELD = 1e-11
"""m^2 or rad^2: a pose with no variance above it is held, and has no error to speak of"""
ROUNDING = 1e-13
"""of the smallest eigenvalue of a correlation matrix"""


class CovarianceState(IntEnum):
    """What the covariance of a pose is worth."""

    ABSENT = 0
    """there is none, or no pose"""
    HELD = 1
    """zero: the first pose"""
    NOT_POSITIVE_DEFINITE = 2
    """no covariance: it claims a variance below zero, or none in some direction, or is not symmetric"""
    POSITIVE_DEFINITE = 3


def covariance_state(estimate: Estimate) -> NDArray[np.uint8]:
    """(T,) a `CovarianceState` for each pose; scaled by its variances, so that units do not matter."""
    state = np.zeros(len(estimate.world_T_imu), dtype=np.uint8)
    if estimate.covariance is None:
        return state
    k = np.flatnonzero(
        np.isfinite(estimate.covariance).all(axis=(1, 2)) & np.isfinite(estimate.world_T_imu).all(axis=(1, 2))
    )
    P = estimate.covariance[k]
    state[k] = np.where(
        is_positive_definite(P), CovarianceState.POSITIVE_DEFINITE, CovarianceState.NOT_POSITIVE_DEFINITE
    )
    state[k[np.abs(P).max(axis=(1, 2), initial=0.0) <= HELD]] = CovarianceState.HELD
    return state


def is_positive_definite(P: FloatArray) -> NDArray[np.bool_]:
    """(n,) which finite matrices (n, d, d) are symmetric (to 1e-6) and positive definite beyond rounding."""
    variance = np.einsum("nii->ni", P)
    positive = (variance > 0.0).all(axis=1)
    scale = np.sqrt(np.where(positive[:, None], variance, 1.0))
    C = P / (scale[:, :, None] * scale[:, None, :])
    symmetric = np.abs(C - np.swapaxes(C, 1, 2)).max(axis=(1, 2), initial=0.0) <= 1e-6
    positive &= symmetric
    positive[positive] = np.linalg.eigvalsh(0.5 * (C + np.swapaxes(C, 1, 2))[positive])[:, 0] > ROUNDING
    return np.asarray(positive, dtype=np.bool_)


def squared_norm(error: FloatArray, P: FloatArray) -> FloatArray:
    """(n,) e^T P^-1 e of errors (n, d) with positive definite covariances (n, d, d)."""
    scale = np.sqrt(np.einsum("nii->ni", P))
    C = P / (scale[:, :, None] * scale[:, None, :])
    scaled = error / scale
    return np.asarray(np.einsum("ni,ni->n", scaled, np.linalg.solve(C, scaled[:, :, None])[:, :, 0]))


def body_error(estimate: Estimate, truth: Truth) -> FloatArray:
    """(T, 6) e = log(T^-1 T_true), [v, w] in m and rad, in the body frame of the estimate; NaN where either is."""
    error = np.full((len(estimate.world_T_imu), 6), np.nan)
    k = np.flatnonzero(truth.known & np.isfinite(estimate.world_T_imu).all(axis=(1, 2)))
    error[k] = se3.log(se3.inverse(estimate.world_T_imu[k]) @ truth.world_T_imu[k])
    return error


def nees(estimate: Estimate, truth: Truth) -> FloatArray:
    """(T,) normalised estimation error squared e^T P^-1 e of each pose, e = log(T^-1 T_true) in the body frame, [v, w].

    6 on average for a filter that knows its errors. NaN where there is no truth, no pose or no positive definite
    covariance (the first pose, which is held). Bar-Shalom, Li and Kirubarajan (2001), section 5.4.
    """
    return nees_table(estimate, truth)["pose"].to_numpy()


def nees_table(estimate: Estimate, truth: Truth) -> pd.DataFrame:
    """NEES of each frame: of the `pose` (6 degrees of freedom), and of its `position` and `rotation` (3 each)."""
    table = pd.DataFrame(
        np.nan, index=pd.RangeIndex(len(estimate.world_T_imu), name="frame"), columns=["pose", *PARTS], dtype=np.float64
    )
    k = np.flatnonzero((covariance_state(estimate) == CovarianceState.POSITIVE_DEFINITE) & truth.known)
    if estimate.covariance is None or len(k) == 0:
        return table
    error, P = body_error(estimate, truth)[k], estimate.covariance[k]
    table.loc[k, "pose"] = squared_norm(error, P)
    for name, part in PARTS.items():
        table.loc[k, name] = squared_norm(error[:, part], P[:, part, part])
    return table


def anees(runs: Iterable[tuple[Estimate, Truth]]) -> pd.DataFrame:
    """NEES averaged over runs, one row per `frame`: `anees`, `runs` that have it, and 95 % bounds `low` and `high`.

    The bounds assume that the runs are independent (other noise, other seeds) and errors Gaussian; of frames they
    assume nothing, each row stands alone. Runs may differ in length. The mean of `anees` over frames, whose errors are
    correlated, lies inside the bounds of a single frame with at least about their probability.
    """
    return nees_over_runs([nees(estimate, truth) for estimate, truth in runs])


def sigma_ratio(estimate: Estimate, reference: Estimate) -> pd.DataFrame:
    """How sure an estimate is beside the reference, one row per frame: `position` and `rotation`.

    sqrt(tr P / tr P_ref) of the two 3x3 blocks in each one's own body frame (their traces do not depend on it). A
    filter knows less than the smoother: below 1 it claims to know more. NaN where either has no positive definite
    covariance.
    """
    table = pd.DataFrame(
        np.nan, index=pd.RangeIndex(len(estimate.world_T_imu), name="frame"), columns=list(PARTS), dtype=np.float64
    )
    sound = [covariance_state(e) == CovarianceState.POSITIVE_DEFINITE for e in (estimate, reference)]
    k = np.flatnonzero(sound[0] & sound[1])
    if estimate.covariance is not None and reference.covariance is not None:
        for name, part in PARTS.items():
            P, P_ref = (np.einsum("tii->t", c[k, part, part]) for c in (estimate.covariance, reference.covariance))
            table.loc[k, name] = np.sqrt(P / P_ref)
    return table
