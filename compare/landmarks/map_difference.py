"""Difference of two landmark maps, matched by landmark index."""

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Sequence
from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import se3

from ..consistency.covariance import is_positive_definite
from ..consistency.reference_nees import difference_covariance
from ..residuals.residual_classes import DEPTHS, depth_classes
from ..statistics.chi_square import mahalanobis_squared

MIN_WITH_SIGMAS = 10
"""smallest number of landmarks with `sigmas` for a median: few have a positive definite P - P_ref"""


def map_difference(sequence: Sequence, estimate: Estimate, reference: Estimate) -> pd.DataFrame:
    """Difference of the landmarks that both maps have and a frame with both poses observes, one row per `landmark`.

    Columns: `distance` in the world, m, which includes drift of the trajectories; `seen`, the distance between the
    points in the camera frames of their own trajectories, m, without drift, at the observation nearest to the
    landmark; `depth` of the reference's point there, m; `sigmas`, the Mahalanobis norm sqrt(d^T (P - P_ref)^-1 d) of
    the world difference d, as both use the same data, NaN without covariances; `left_out`, whether P - P_ref is not
    positive definite. For a consistent pair the square of `sigmas` is chi-square with 3 degrees of freedom.
    """
    index, mine, its = np.intersect1d(estimate.landmarks.index, reference.landmarks.index, return_indices=True)
    frame = _nearest_observation(sequence, estimate, reference)[index]
    known = (frame >= 0) & ~np.isnan(estimate.landmarks.position[mine]).any(axis=1)
    index, mine, its, frame = index[known], mine[known], its[known], frame[known]
    p, q = estimate.landmarks.position[mine], reference.landmarks.position[its]
    with np.errstate(invalid="ignore"):  # a landmark at infinity
        p_cam, q_cam = (
            se3.transform(se3.inverse(e.world_T_imu[frame] @ sequence.imu_T_cam), x)
            for e, x in ((estimate, p), (reference, q))
        )
    sigmas, left_out = np.full(len(index), np.nan), np.zeros(len(index), dtype=np.bool_)
    if estimate.landmarks.covariance is not None and reference.landmarks.covariance is not None:
        P, Q = estimate.landmarks.covariance[mine], reference.landmarks.covariance[its]
        valid = np.flatnonzero(np.isfinite(P).all(axis=(1, 2)) & np.isfinite(Q).all(axis=(1, 2)))
        valid = valid[is_positive_definite(P[valid]) & is_positive_definite(Q[valid])]
        D = difference_covariance(P[valid], Q[valid])
        positive = np.isfinite(D).all(axis=(1, 2))
        left_out[valid[~positive]] = True
        sigmas[valid[positive]] = np.sqrt(mahalanobis_squared((p - q)[valid[positive]], D[positive]))
    return pd.DataFrame(
        {
            "landmark": index,
            "distance": np.linalg.norm(p - q, axis=1),
            "seen": np.where(np.isinf(p).any(axis=1), np.inf, np.linalg.norm(p_cam - q_cam, axis=1)),
            "depth": q_cam[:, 2],
            "sigmas": sigmas,
            "left_out": left_out,
        }
    )


def map_by_depth(table: pd.DataFrame) -> pd.DataFrame:
    """Medians of a `map_difference` by depth class: `n`, `distance`, `seen`, `sigmas` and the number `with_sigmas`.

    Rows are named by their edges in m; points behind the camera belong to none. `sigmas` is NaN where fewer than
    `MIN_WITH_SIGMAS` landmarks of a class have them.
    """
    groups = table.groupby(pd.cut(table["depth"], DEPTHS, labels=depth_classes(), right=False), observed=False)
    count = groups["sigmas"].count()
    return pd.DataFrame(
        {
            "n": groups.size(),
            **{column: groups[column].median() for column in ("distance", "seen")},
            "sigmas": groups["sigmas"].median().where(count >= MIN_WITH_SIGMAS),
            "with_sigmas": count,
        }
    )


def _nearest_observation(sequence: Sequence, estimate: Estimate, reference: Estimate) -> IntArray:
    """Frame (N,) with the observation of each landmark nearest to it on the reference's path, or -1.

    Only frames in which both have a pose count. Landmarks that the reference lacks have -1.
    """
    o = sequence.observations
    position = np.full((sequence.n_landmarks, 3), np.nan)
    position[reference.landmarks.index] = reference.landmarks.position
    both = np.isfinite(estimate.world_T_imu[:, 0, 0]) & np.isfinite(reference.world_T_imu[:, 0, 0])
    center = (reference.world_T_imu @ sequence.imu_T_cam)[:, :3, 3]
    with np.errstate(invalid="ignore"):
        distance = np.linalg.norm(position[o.landmark] - center[o.frame], axis=1)
    distance[~both[o.frame]] = np.nan
    seen = np.flatnonzero(np.isfinite(distance))
    seen = seen[np.argsort(-distance[seen], kind="stable")]  # the last write wins: the nearest
    frame = np.full(sequence.n_landmarks, -1, dtype=np.int64)
    frame[o.landmark[seen]] = o.frame[seen]
    return frame
