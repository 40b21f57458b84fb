"""Where one trajectory parts from another, frame by frame."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FgbaselineError, FloatArray, so3

from ..statistics.descriptive import summarised
from .alignment import align_se3
from .path import distance_travelled, travel_frame


def divergence(estimate: Estimate, reference: Estimate, up: ArrayLike = (0.0, 0.0, 1.0)) -> pd.DataFrame:
    """How far each pose of an estimate is from the reference's, without any alignment (both start at the same pose).

    `up` (3,) is the unit vector that points up in the world (`Sequence.up`). For the columns see `pose_errors`.
    """
    return pose_errors(estimate.world_T_imu, reference.world_T_imu, up)


def truth_errors(
    estimate: Estimate, truth: Truth, up: ArrayLike = (0.0, 0.0, 1.0), *, aligned: bool = False
) -> pd.DataFrame:
    """How far each pose is from the true one: as it is, or after the SE(3) motion that fits all positions best.

    Frames without truth, and frames that the estimator did not reach, are NaN. For the columns see `pose_errors`.
    """
    poses = estimate.world_T_imu
    if aligned:
        both = truth.known & np.isfinite(poses).all(axis=(1, 2))
        if both.any():
            poses = align_se3(poses[both, :3, 3], truth.world_T_imu[both, :3, 3]) @ poses
    return pose_errors(poses, truth.world_T_imu, up)


def pose_errors(poses: FloatArray, reference: FloatArray, up: ArrayLike) -> pd.DataFrame:
    """A table with one row per frame of poses (T, 4, 4) against reference poses (T, 4, 4), indexed by `frame`:

    `position` |p - p_ref| in m; `along`, `across` (to the left) and `up` its components in the reference's frame,
    that is along the reference's direction of travel seen from above, square to it, and along `up`; `rotation_deg`
    the angle of R_ref^T R and `heading_deg` its part about `up`, to the left positive; `travelled` the length of the
    reference's path so far, m. NaN where either pose is.
    """
    if poses.shape != reference.shape:
        raise FgbaselineError(f"trajectories of {len(poses)} and {len(reference)} poses cannot be compared by frame")
    difference = poses[:, :3, 3] - reference[:, :3, 3]
    forward, left, upward = travel_frame(reference[:, :3, 3], np.asarray(up, dtype=np.float64))
    finite = np.isfinite(poses).all(axis=(1, 2)) & np.isfinite(reference).all(axis=(1, 2))
    angle, heading = np.full((2, len(poses)), np.nan)
    turned = poses[finite, :3, :3] @ np.swapaxes(reference[finite, :3, :3], 1, 2)
    angle[finite] = np.rad2deg(so3.rotation_angle(turned))
    heading[finite] = np.rad2deg(so3.turn_about(upward, turned))
    return pd.DataFrame(
        {
            "position": np.linalg.norm(difference, axis=1),
            "along": np.einsum("ti,ti->t", difference, forward),
            "across": np.einsum("ti,ti->t", difference, left),
            "up": difference @ upward,
            "rotation_deg": angle,
            "heading_deg": heading,
            "travelled": distance_travelled(reference[:, :3, 3]),
        },
        index=pd.RangeIndex(len(poses), name="frame"),
    )


def divergence_summary(table: pd.DataFrame) -> dict[str, float]:
    """RMSE, mean, median, 95 %, largest and final position difference (m), and the rotation's RMSE and final (deg)."""
    return {
        **summarised(table["position"]),
        "final": float(table["position"].iloc[-1]),
        "rotation_rmse_deg": summarised(table["rotation_deg"])["rmse"],
        "rotation_final_deg": float(table["rotation_deg"].iloc[-1]),
    }
