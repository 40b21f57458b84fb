"""What is known of each frame's covariance and innovation, and the tables that a report folds away."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd

from fgbaseline import compare
from fgbaseline.compare import CovarianceState

from .comparison import Result, Run


def consistency_series(result: Result) -> pd.DataFrame:
    """By frame: what the covariance is worth, NEES against truth and reference, sigma ratios, NIS and its degrees."""
    evidence, recorded = result.evidence, result.estimate.innovations
    words = [CovarianceState(state).name.lower().replace("_", " ") for state in evidence.covariance]
    table = pd.DataFrame({"covariance": words}, index=pd.RangeIndex(len(words), name="frame"))
    if evidence.nees is not None:
        table = table.join(evidence.nees.add_prefix("nees_").rename(columns={"nees_pose": "nees"}))
    if evidence.difference is not None:
        table["nees_reference"] = evidence.difference.nees
    if evidence.sigma_ratio is not None:
        table = table.join(evidence.sigma_ratio.add_prefix("sigma_ratio_"))
    if recorded is not None:
        table["nis"], table["nis_degrees"] = recorded.nis, recorded.degrees
    return table


def write_tables(run: Run, folder: Path) -> None:
    """reprojection_classes.csv, moved_points.csv, map_by_depth.csv and held_out.csv, into an existing folder.

    The first column names the estimator; a table that the run has nothing for is not written.
    """
    of_each: dict[str, Callable[[Result], pd.DataFrame | None]] = {
        "reprojection_classes": lambda r: r.evidence.patterns,
        "moved_points": lambda r: r.evidence.moved[r.evidence.moved["moved"]].drop(columns="moved"),
        "map_by_depth": map_by_depth,
    }
    for name, of in of_each.items():
        parts = {r.name: part for r in run.answered if (part := of(r)) is not None and len(part)}
        if parts:
            joined = pd.concat(parts, names=["estimator"]).reset_index(level="estimator")
            joined.to_csv(folder / f"{name}.csv", index=False, float_format="%.6g")
    if run.held_out is not None and len(run.held_out.ranking):
        run.held_out.ranking.to_csv(folder / "held_out.csv", float_format="%.6g")


def map_by_depth(result: Result) -> pd.DataFrame | None:
    """See `compare.map_by_depth`; None for the reference and where no landmark is shared."""
    table = result.evidence.map
    return None if table is None or len(table) == 0 else compare.map_by_depth(table).reset_index()
