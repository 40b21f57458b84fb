"""Where the landmarks of two estimates differ, matched by their number."""

from itertools import pairwise

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Sequence
from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import se3

from ..consistency.nees import is_positive_definite, squared_norm
from ..consistency.reference_nees import difference_covariance

DEPTHS = (0.0, 5.0, 10.0, 20.0, 40.0, 80.0, np.inf)
"""m, edges of the classes by depth"""


def map_difference(sequence: Sequence, estimate: Estimate, reference: Estimate) -> pd.DataFrame:
    """One row per `landmark` that both have, at a place that is not NaN, and some frame with both poses sees:

    `distance` in the world as it is, m, with whatever drift the paths have; `seen` the distance of the two points as
    the two cameras see them, each in its own camera frame at the sight nearest to the reference's camera, m, which has
    no drift in it; `depth` of the reference's point at that sight, m; `sigmas` the world difference over the covariance
    of the difference, sqrt(d^T (P - P_ref)^-1 d), since the two share their data. `sigmas` is NaN where an estimator
    gives no covariance, and `left_out` where P - P_ref is not positive definite. For a consistent pair the square of
    `sigmas` is chi-square with 3 degrees of freedom.
    """
    index, mine, its = np.intersect1d(estimate.landmarks.index, reference.landmarks.index, return_indices=True)
    frame = _nearest_sight(sequence, estimate, reference)[index]
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
        sound = np.flatnonzero(np.isfinite(P).all(axis=(1, 2)) & np.isfinite(Q).all(axis=(1, 2)))
        sound = sound[is_positive_definite(P[sound]) & is_positive_definite(Q[sound])]
        D = difference_covariance(P[sound], Q[sound])
        positive = np.isfinite(D).all(axis=(1, 2))
        left_out[sound[~positive]] = True
        sigmas[sound[positive]] = np.sqrt(squared_norm((p - q)[sound[positive]], D[positive]))
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
    """Medians of a `map_difference` for each class of depth: `n`, `distance`, `seen`, `sigmas` and how many have them.

    Rows are named by their edges in m; points that lie behind the camera are in none.
    """
    groups = table.groupby(pd.cut(table["depth"], DEPTHS, labels=depth_classes(), right=False), observed=False)
    return pd.DataFrame(
        {
            "n": groups.size(),
            **{column: groups[column].median() for column in ("distance", "seen", "sigmas")},
            "with_sigmas": groups["sigmas"].count(),
        }
    )


def depth_classes() -> list[str]:
    """The classes by depth, as tables name them."""
    return [f"{low:g} to {high:g} m" if np.isfinite(high) else f"{low:g} m and more" for low, high in pairwise(DEPTHS)]


def _nearest_sight(sequence: Sequence, estimate: Estimate, reference: Estimate) -> IntArray:
    """(N,) the frame that sees each landmark from nearest along the reference's path; -1 where none does.

    Of frames in which both have a pose; a landmark the reference does not have counts as seen nowhere.
    """
    o = sequence.observations
    position = np.full((sequence.n_landmarks, 3), np.nan)
    position[reference.landmarks.index] = reference.landmarks.position
    both = np.isfinite(estimate.world_T_imu[:, 0, 0]) & np.isfinite(reference.world_T_imu[:, 0, 0])
    centre = (reference.world_T_imu @ sequence.imu_T_cam)[:, :3, 3]
    with np.errstate(invalid="ignore"):
        distance = np.linalg.norm(position[o.landmark] - centre[o.frame], axis=1)
    distance[~both[o.frame]] = np.nan
    seen = np.flatnonzero(np.isfinite(distance))
    seen = seen[np.argsort(-distance[seen], kind="stable")]  # the last write wins: the nearest
    frame = np.full(sequence.n_landmarks, -1, dtype=np.int64)
    frame[o.landmark[seen]] = o.frame[seen]
    return frame
