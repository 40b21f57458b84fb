"""Error of each pose against a reference, along and across the track, and its growth along the path."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fgbaseline.data import Estimate, Truth
from fgbaseline.geometry import FgbaselineError, FloatArray, InputError, so3
from fgbaseline.geometry.path_length import distance_traveled

from ..column_tables import Columns, to_frame
from ..statistics.descriptive import summarized
from .alignment import Align, Alignment, align, align_se3
from .along_track_frame import along_track_frame
from .association import MatchedTrajectories

if TYPE_CHECKING:
    import pandas as pd


def divergence(estimate: Estimate, reference: Estimate, up: ArrayLike = (0.0, 0.0, 1.0)) -> "pd.DataFrame":
    """Error of each pose of an estimate against the reference, without alignment (both start at the same pose).

    `up` (3,) is the unit vector that points up in the world (`Sequence.up`). For the columns see `pose_errors`.
    """
    return pose_errors(estimate.world_T_imu, reference.world_T_imu, up)


def truth_errors(
    estimate: Estimate, truth: Truth, up: ArrayLike = (0.0, 0.0, 1.0), *, aligned: bool | Align = False
) -> "pd.DataFrame":
    """Error of each pose against ground truth.

    `aligned` is False for no alignment, True for SE(3), or another kind; the alignment is over all frames that both
    have. NaN in frames without truth and in frames that the estimator did not reach. For the columns see `pose_errors`.
    """
    poses = estimate.world_T_imu
    if aligned is True:
        both = truth.known & np.isfinite(poses).all(axis=(1, 2))
        if both.any():
            poses = align_se3(poses[both, :3, 3], truth.world_T_imu[both, :3, 3]) @ poses
    elif aligned:
        poses = truth_alignment(estimate, truth, aligned, up).apply(poses)
    return pose_errors(poses, truth.world_T_imu, up)


def truth_alignment(estimate: Estimate, truth: Truth, kind: Align, up: ArrayLike = (0.0, 0.0, 1.0)) -> Alignment:
    """Alignment of an estimate to the truth over the frames that both have; `Align.NONE` without such a frame."""
    both = truth.known & np.isfinite(estimate.world_T_imu).all(axis=(1, 2))
    if not both.any():
        return Alignment()
    return align(estimate.world_T_imu[both], truth.world_T_imu[both], kind, up=up)


def pose_errors(poses: FloatArray, reference: FloatArray, up: ArrayLike) -> "pd.DataFrame":
    """Table of `pose_error_columns`."""
    return to_frame(pose_error_columns(poses, reference, up), "frame")


def pose_error_columns(poses: FloatArray, reference: FloatArray, up: ArrayLike) -> Columns:
    """Errors of poses (T, 4, 4) against reference poses (T, 4, 4), a row for each frame.

    Columns: `position`, |p - p_ref|, m; its components `along` and `across` the reference's horizontal direction of
    travel (left positive) and `up`, m; `rotation_deg`, the angle of R_ref^T R; `heading_deg`, the part about `up` (left
    positive); `traveled`, the length of the reference's path so far, m. NaN where either pose is. Raises
    FgbaselineError for different numbers of poses.
    """
    if poses.shape != reference.shape:
        raise FgbaselineError(f"trajectories of {len(poses)} and {len(reference)} poses cannot be compared by frame")
    difference = poses[:, :3, 3] - reference[:, :3, 3]
    forward, left, upward = along_track_frame(reference[:, :3, 3], np.asarray(up, dtype=np.float64))
    finite = np.isfinite(poses).all(axis=(1, 2)) & np.isfinite(reference).all(axis=(1, 2))
    angle, heading = np.full((2, len(poses)), np.nan)
    turned = poses[finite, :3, :3] @ np.swapaxes(reference[finite, :3, :3], 1, 2)
    angle[finite] = np.rad2deg(so3.rotation_angle(turned))
    heading[finite] = np.rad2deg(so3.twist_angle(upward, turned))
    return {
        "position": np.linalg.norm(difference, axis=1),
        "along": np.einsum("ti,ti->t", difference, forward),
        "across": np.einsum("ti,ti->t", difference, left),
        "up": difference @ upward,
        "rotation_deg": angle,
        "heading_deg": heading,
        "traveled": distance_traveled(reference[:, :3, 3]),
    }


def divergence_summary(table: "pd.DataFrame") -> dict[str, float]:
    """RMSE, mean, median, p95, maximum and final position error (m); RMSE and final rotation error (deg)."""
    return {
        **summarized(table["position"]),
        "final": float(table["position"].iloc[-1]),
        "rotation_rmse_deg": summarized(table["rotation_deg"])["rmse"],
        "rotation_final_deg": float(table["rotation_deg"].iloc[-1]),
    }


PARTS = 10
"""pieces of equal length for the growth of the error"""


def divergence_along_path(matched: MatchedTrajectories, up: ArrayLike = (0.0, 0.0, 1.0)) -> "pd.DataFrame":
    """Table of `divergence_columns`."""
    return to_frame(divergence_columns(matched, up), "frame")


def divergence_columns(matched: MatchedTrajectories, up: ArrayLike = (0.0, 0.0, 1.0)) -> Columns:
    """Errors of matched poses as of `pose_error_columns`, with the stamp `t`, s, and `percent_of_path`.

    `percent_of_path` is the position error over the distance traveled, %; NaN before the reference moves. The alignment
    is that of `matched`; for growth from a common start use `none` or `first-pose`.
    """
    columns = pose_error_columns(matched.estimate.world_T_body, matched.reference.world_T_body, up)
    moved = np.where(columns["traveled"] > 0, columns["traveled"], np.nan)
    return {**columns, "t": matched.reference.t, "percent_of_path": 100.0 * columns["position"] / moved}


def divergence_growth(table: "pd.DataFrame", parts: int = PARTS) -> "pd.DataFrame":
    """Growth of the error over `parts` pieces of the path of equal length, from a `divergence_along_path` table.

    One row per piece: `from_m`, `to_m`, `frames`, `rmse` of the position error (m), its growth `per_meter` (m/m) and
    `per_frame` (m) from the piece's first pose to the next one's, `heading_deg` at its end. NaN for a piece without
    a pose. Raises InputError where the reference does not move.
    """
    traveled = table["traveled"].to_numpy()
    if parts < 1 or not traveled[-1] > 0:
        raise InputError("growth: expected a reference that moves and at least 1 part")
    edges = np.linspace(0.0, traveled[-1], parts + 1)
    first = np.searchsorted(traveled, edges[:-1], side="left")
    last = np.append(first[1:], len(traveled) - 1)
    position = table["position"].to_numpy()
    frames = last - first
    frames[-1] += 1
    end = np.append(first[1:], len(traveled))
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = position[last] - position[first]
        return to_frame(
            {
                "from_m": edges[:-1],
                "to_m": edges[1:],
                "frames": frames,
                "rmse": np.array([summarized(position[a:b])["rmse"] for a, b in zip(first, end, strict=True)]),
                "per_meter": grown / (traveled[last] - traveled[first]),
                "per_frame": grown / (last - first),
                "heading_deg": table["heading_deg"].to_numpy()[last],
            },
            "part",
        )


@dataclass(frozen=True, slots=True)
class Exceedance:
    """First pose at which an error exceeds a bound."""

    frame: int
    t: float
    """s"""
    traveled: float
    """m"""
    value: float
    """error, in the unit of the column"""


def first_exceedance(table: "pd.DataFrame | Columns", bound: float, column: str = "position") -> Exceedance | None:
    """First row of a `divergence_along_path` table, or of its columns, where |column| exceeds a bound; None without."""
    values, t, traveled = (np.asarray(table[name]) for name in (column, "t", "traveled"))
    beyond = np.flatnonzero(np.abs(values) > bound)
    if len(beyond) == 0:
        return None
    k = int(beyond[0])
    return Exceedance(k, float(t[k]), float(traveled[k]), float(values[k]))
