"""What an estimate says every pixel should have been, against what was measured."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from fgbaseline.data import Estimate, Sequence, Status
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import se3

from ..statistics.descriptive import known, mean, summarised

ROWS = ("uL", "vL", "uR", "vR")
NEAR = 3.0
"""px: below it an observation counts as explained"""


def reprojection(sequence: Sequence, estimate: Estimate) -> pd.DataFrame:
    """One row for each observation of the sequence whose landmark and pose the estimate has, with the columns

    `observation` (its index in the sequence), `frame`, `landmark`, `uL vL uR vR` measured minus predicted in px,
    `error` the Euclidean norm of these four, `depth` in m in front of the left camera (the prediction follows the
    same formula behind it), and `used`, whether the estimator used it. Residuals of a landmark at infinity or
    in the camera's plane are infinite, those of a landmark that is NaN are NaN.
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
    residual[np.isnan(residual) & ~missing[:, None]] = np.inf
    return pd.DataFrame(
        {
            "observation": chosen,
            "frame": o.frame[chosen],
            "landmark": o.landmark[chosen],
            **{row: residual[:, i] for i, row in enumerate(ROWS)},
            "error": np.linalg.norm(residual, axis=1),
            "depth": p_cam[:, 2],
            "used": estimate.used[chosen],
        }
    )


def reprojection_summary(table: pd.DataFrame) -> dict[str, float | int]:
    """Median, mean, RMSE, 95 % and largest error (px), share under 3 px, points behind the camera, the `n` observations
    that this is over, and how many are `missing` beside them (NaN)."""
    error = known(table["error"])
    return {
        **summarised(table["error"]),
        "under_3px": float((error < NEAR).mean()) if len(error) else float("nan"),
        "behind_camera": int((table["depth"] <= 0).sum()),
        "n": len(error),
    }


def component_summary(table: pd.DataFrame) -> dict[str, dict[str, float]]:
    """For each of uL, vL, uR, vR its bias (mean) and spread (standard deviation) over a reprojection table, px."""
    found = {}
    for row in ROWS:
        r = known(table[row])
        spread = float("nan") if len(r) == 0 else float(np.std(r)) if np.isfinite(r).all() else float("inf")
        found[row] = {"bias": mean(r) if len(r) else float("nan"), "spread": spread}
    return found


def reprojection_by(table: pd.DataFrame, what: str) -> pd.DataFrame:
    """Median, mean, RMSE, share under 3 px, points behind the camera, number and how many are `missing` (NaN), for each
    `frame` or `landmark`."""
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


def commonly_used(estimates: Iterable[Estimate]) -> BoolArray | None:
    """(n,) the observations that every estimate used. Those that use none by nature, and those that failed on the way,
    do not count; None where that leaves none."""
    using = [e.used for e in estimates if e.used.any() and e.status is not Status.FAILED]
    return np.asarray(np.logical_and.reduce(using), dtype=np.bool_) if using else None
