"""Reprojection residuals: measured minus predicted stereo pixels, and their statistics."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Sequence, Status
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.stereo_camera import PIXEL_COMPONENTS

from ..statistics.descriptive import quantile, summarized, without_nan

NEAR = 3.0
"""px; error below which an observation counts in `under_3px`"""
MAD_TO_SIGMA = 1.4826
"""standard deviation of a Gaussian over its median absolute deviation"""


def reprojection(sequence: Sequence, estimate: Estimate) -> pd.DataFrame:
    """Reprojection residuals, a row for each observation whose landmark and pose the estimate has.

    Columns: `observation`, index in the sequence; `frame`; `landmark`; `uL vL uR vR`, measured minus predicted, px;
    `error`, the Euclidean norm of these four, px (of uL and vL for one camera, whose uR and vR are NaN); `depth` along
    the axis of the left camera, m; and `used`, whether the estimator used the observation.

    The projection formula is also applied behind the camera. Residuals are infinite for a landmark at infinity or in
    the camera's plane, and NaN for a landmark that is NaN.
    """
    o = sequence.observations
    position = np.full((sequence.n_landmarks, 3), np.nan)
    position[estimate.landmarks.index] = estimate.landmarks.position
    has_landmark = np.zeros(sequence.n_landmarks, dtype=np.bool_)
    has_landmark[estimate.landmarks.index] = True
    has_pose: BoolArray = np.isfinite(estimate.world_T_imu[:, 0, 0])
    chosen = np.flatnonzero(has_landmark[o.landmark] & has_pose[o.frame])
    cam_T_world = np.full_like(estimate.world_T_imu, np.nan)
    cam_T_world[has_pose] = se3.inverse(estimate.world_T_imu[has_pose] @ sequence.imu_T_cam)
    with np.errstate(divide="ignore", invalid="ignore"):
        p_cam = se3.transform(cam_T_world[o.frame[chosen]], position[o.landmark[chosen]])
        residual = o.pixel[chosen] - sequence.camera.project(p_cam)
    missing = np.isnan(position[o.landmark[chosen]]).any(axis=1)
    measured = residual[:, :2] if sequence.monocular else residual
    measured[np.isnan(measured) & ~missing[:, None]] = np.inf
    return pd.DataFrame(
        {
            "observation": chosen,
            "frame": o.frame[chosen],
            "landmark": o.landmark[chosen],
            **{row: residual[:, i] for i, row in enumerate(PIXEL_COMPONENTS)},
            "error": np.linalg.norm(measured, axis=1),
            "depth": p_cam[:, 2],
            "used": estimate.used[chosen],
        }
    )


def reprojection_summary(table: pd.DataFrame) -> dict[str, float | int]:
    """RMSE, mean, median, 95th percentile and maximum error (px), share under 3 px and number behind the camera.

    Over `n` observations; `missing` counts those that are NaN.
    """
    error = without_nan(table["error"])
    return {
        **summarized(table["error"]),
        "under_3px": float((error < NEAR).mean()) if len(error) else float("nan"),
        "behind_camera": int((table["depth"] <= 0).sum()),
        "n": len(error),
    }


def component_summary(table: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Bias (median) and spread (1.4826 MAD) of uL, vL, uR and vR over a reprojection table, px.

    The spread of Gaussian residuals is their standard deviation. A few residuals of thousands of pixels change neither.
    """
    return {row: _robust(without_nan(table[row])) for row in PIXEL_COMPONENTS}


def _robust(residual: FloatArray) -> dict[str, float]:
    if len(residual) == 0:
        return {"bias": float("nan"), "spread": float("nan")}
    bias = quantile(residual, 0.5)
    deviation = quantile(np.abs(residual - bias), 0.5) if np.isfinite(bias) else np.inf
    return {"bias": bias, "spread": MAD_TO_SIGMA * deviation}


def reprojection_by(table: pd.DataFrame, what: str) -> pd.DataFrame:
    """Statistics of `reprojection_summary` for each `frame` or `landmark`, 95th percentile and maximum aside."""
    near = (table["error"] < NEAR).where(table["error"].notna()).astype(np.float64)
    squared, behind = table["error"] ** 2, table["depth"] <= 0
    groups = table.assign(squared=squared, near=near, behind=behind).groupby(what)
    return pd.DataFrame(
        {
            "median": groups["error"].median(),
            "mean": groups["error"].mean(),
            "rmse": np.sqrt(groups["squared"].mean()),
            "under_3px": groups["near"].mean(),
            "behind_camera": groups["behind"].sum(),
            "n": groups["error"].count(),
            "missing": groups.size() - groups["error"].count(),
        }
    )


def used_by_all(estimates: Iterable[Estimate]) -> BoolArray | None:
    """Observations (n,) that every estimate used; None without such an estimate.

    Failed estimates, and those that by design use no observation, are ignored.
    """
    using = [e.used for e in estimates if e.used.any() and e.status is not Status.FAILED]
    return np.asarray(np.logical_and.reduce(using), dtype=np.bool_) if using else None
