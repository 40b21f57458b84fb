"""The `documented` preset: the problem of the source paper."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, disparity

from ..observations import IntArray, Observations
from ..sequence import Sequence, require_scale
from ..velocity_increments import Shift, back_project, dead_reckoned_path, increments
from ..wording import plural
from .definition import Excluded, LandmarkMode, LandmarkPrior, Problem

MOTION_NOISE = np.diag([0.5, 0.5, 0.5, 0.05, 0.05, 0.05])
"""W of the source paper, added once per step of any length"""
LANDMARK_VARIANCE = 0.01
MAPPING_PIXEL_VARIANCE = 1.0
SLAM_PIXEL_VARIANCE = 15.0
DEFAULT_FEATURES = 1000


def documented(
    sequence: Sequence, features: int | None = DEFAULT_FEATURES, landmark_mode: LandmarkMode = LandmarkMode.UPDATED
) -> Problem:
    """Problem of the source paper on a recording as recorded: no mask, no kernel, no repairs.

    W is added once per step; V = I for mapping and 15 I for SLAM. The `features` most observed landmarks (None: all)
    have the prior 0.01 I at the average of their back-projections along the dead-reckoned path.
    """
    require_scale(sequence)
    if sequence.imu is not None:
        raise InputError(
            "documented: the preset is the problem of the source paper, which has body velocities and no raw inertial "
            "data; use --preset calibrated"
        )
    o = sequence.observations
    chosen = most_observed(o, sequence.n_landmarks, features)
    step = increments(sequence, Shift.AFTER)
    remarks = [
        "data taken as recorded; W = diag(0.5, 0.5, 0.5, 0.05, 0.05, 0.05) added once per step, V = I for mapping "
        "and 15 I for SLAM, landmark prior 0.01 I at the average back-projection"
    ]
    excluded = np.where(np.isin(o.landmark, chosen), Excluded.NO, Excluded.FEATURE_NOT_CHOSEN).astype(np.uint8)
    at_infinity = disparity(o.pixel) == 0.0
    if np.any(at_infinity & (excluded == Excluded.NO)):
        excluded[at_infinity & (excluded == Excluded.NO)] = Excluded.DISPARITY
        n = int(np.sum(excluded == Excluded.DISPARITY))
        remarks.append(
            f"{plural(n, 'observation has', 'observations have')} a disparity of exactly zero: left out, having no "
            "back-projection"
        )
        chosen = np.unique(o.landmark[excluded == Excluded.NO])
    mean = average_back_projections(sequence, dead_reckoned_path(step), chosen, excluded == Excluded.NO)
    return Problem(
        preset="documented",
        findings=sequence.findings,
        sequence=sequence,
        increment=step,
        increment_covariance=np.broadcast_to(MOTION_NOISE, (len(step), 6, 6)),
        pixel_variance=SLAM_PIXEL_VARIANCE,
        mapping_pixel_variance=MAPPING_PIXEL_VARIANCE,
        features=chosen,
        excluded=excluded,
        initial_pose=np.eye(4),
        initial_covariance=np.zeros((6, 6)),
        landmark_prior=LandmarkPrior(mean, LANDMARK_VARIANCE * np.eye(3)),
        landmark_mode=landmark_mode,
        remarks=tuple(remarks),
    )


def most_observed(observations: Observations, n_landmarks: int, features: int | None) -> IntArray:
    """Increasing indices (m,) of the most observed landmarks (ties: lower index first); None: all observed ones.

    Raises InputError for fewer than one feature.
    """
    if features is not None and features < 1:
        raise InputError(f"features: expected a number of at least 1 or 'all', got {features}")
    counts = observations.counts(n_landmarks)
    order = np.argsort(-counts, kind="stable")
    order = order[: int(np.count_nonzero(counts))]
    return np.sort(order[:features]).astype(np.int64)


def average_back_projections(
    sequence: Sequence, world_T_imu: FloatArray, features: IntArray, chosen: np.ndarray
) -> FloatArray:
    """Mean back-projection (m, 3) of each feature over its chosen observations (n,), along a path (T, 4, 4)."""
    row = np.searchsorted(features, sequence.observations.landmark[chosen])
    points = back_project(sequence, world_T_imu, chosen)
    counts = np.bincount(row, minlength=len(features))
    sums = np.stack([np.bincount(row, weights=points[:, i], minlength=len(features)) for i in range(3)], axis=1)
    return sums / counts[:, None]
