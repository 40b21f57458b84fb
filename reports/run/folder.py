"""Folder of a run: summary, tables, trajectories, landmarks, series, figures and page."""

import csv
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fgbaseline.compare import CovarianceState, reprojection_by
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.data import Estimate, write_tum
from fgbaseline.data.tracking import Pictures

from .. import figures
from ..formatting import counted
from ..html.run_page import render
from ..results.json_files import SUMMARY
from ..results.reader import TRUTH
from ..results.run import Summary, summarize
from ..tables.run import main_table, main_values, metrics_table
from ..tables.writers import latex, markdown, write_csv


def write_run(run: Run, folder: Path, processes: int = 1, pictures: Pictures | None = None) -> Summary:
    """Writes all files of a run into an existing, empty folder; returns the summary.

    `processes` draw the figures in parallel; a caller that is itself one of several processes leaves it at one. The
    page shows the `pictures`.
    """
    with figures.drawn_in_background(run, processes) as finished:
        summary = write_numbers(run, folder)
        drawn = finished()
    (folder / "figures").mkdir()
    figures.save(drawn, folder / "figures")
    write_page(run, summary, folder, drawn, pictures)
    return summary


def write_numbers(run: Run, folder: Path) -> Summary:
    """Writes all files except figures and page; returns the summary."""
    summary = summarize(run)
    sequence, truth = run.problem.sequence, run.problem.sequence.truth
    for name in ("trajectories", "landmarks", "series", "tables"):
        (folder / name).mkdir()
    for name, result in run.results.items():
        columns = {str(key): column.to_numpy() for key, column in _series(run, result).items()}
        write_csv(folder / "series" / f"{name}.csv", {"frame": range(run.problem.n_frames), **columns}, "%.9g")
        if result.answered:
            write_tum(folder / "trajectories" / f"{name}.tum", sequence.t, result.estimate.world_T_imu, sequence.up)
            _write_landmarks(folder / "landmarks" / f"{name}.csv", run, result.estimate)
    if truth is not None:
        write_tum(folder / TRUTH, sequence.t, truth.world_T_imu, sequence.up if truth.up is None else truth.up)
    _write_tables(run, folder / "tables")
    metrics_table(summary).to_csv(folder / "metrics.csv", index=False)
    content = summary.content
    main_values(content["estimators"]).to_csv(folder / "table.csv")
    table = main_table(run, content["estimators"]).transposed("metric")
    table = replace(table, caption=f"{_title(run)} {table.caption}")
    (folder / "table.md").write_text(markdown(table), encoding="utf-8")
    (folder / "table.tex").write_text(latex(table), encoding="utf-8")
    (folder / SUMMARY).write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return summary


def _title(run: Run) -> str:
    """Content of the main table: recording and reference."""
    against = "" if run.reference is None else f"; the reference is {run.reference}"
    return f"Estimators on {run.problem.sequence.name} ({counted(run.problem.n_frames, 'frame')}){against}."


def write_page(
    run: Run,
    summary: Summary,
    folder: Path,
    drawn: Mapping[str, Figure | figures.EncodedFigure],
    pictures: Pictures | None = None,
) -> None:
    """Writes `report.html` with the given figures and images."""
    (folder / "report.html").write_text(render(run, summary.content, drawn, pictures), encoding="utf-8")


def _write_landmarks(path: Path, run: Run, estimate: Estimate) -> None:
    """Writes id,x,y,z,n_used of every landmark of an estimate, m, in the world frame."""
    landmarks = estimate.landmarks
    used = run.problem.sequence.observations.landmark[estimate.used]
    n_used = np.bincount(used, minlength=run.problem.sequence.n_landmarks)[landmarks.index]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["id", "x", "y", "z", "n_used"])
        for index, position, n in zip(landmarks.index.tolist(), landmarks.position.tolist(), n_used, strict=True):
            writer.writerow([index, *position, int(n)])


def _series(run: Run, result: Result) -> pd.DataFrame:
    """One row per frame: time stamp, divergence, error to truth, reprojection, NEES and seconds spent.

    With raw inertial data also velocity and biases: see `InertialEvidence.series`.
    """
    T = run.problem.n_frames
    stamps = [
        repr(t) for t in run.problem.sequence.t.tolist()
    ]  # all digits: nine of a Unix time would be whole seconds
    table = pd.DataFrame({"t": stamps}, index=pd.RangeIndex(T, name="frame"))
    for prefix, errors in (("divergence", result.divergence), ("truth", result.truth)):
        if errors is not None:
            table = table.join(errors.add_prefix(f"{prefix}_"))
    table = table.join(reprojection_by(result.reprojection, "frame").add_prefix("reprojection_"))
    table = table.join(_consistency(result))
    if result.inertial is not None:
        table = table.join(result.inertial.series)
    table["seconds"] = result.estimate.seconds if len(result.estimate.seconds) == T else np.nan
    return table


def _consistency(result: Result) -> pd.DataFrame:
    """Table with a row per frame: state of the covariance, NEES to truth and reference, sigma ratios, NIS."""
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


def _write_tables(run: Run, folder: Path) -> None:
    """Writes trust.csv, events.csv, reprojection_classes.csv, moved_points.csv, map_by_depth.csv and held_out.csv.

    The first column has the estimator; empty tables are not written.
    """
    if run.trust.criteria:
        criteria = pd.DataFrame([asdict(c) | {"verdict": c.verdict.name.lower()} for c in run.trust.criteria])
        criteria = criteria.rename(columns={"doubtful": "trusted_limit", "untrusted": "doubtful_limit"})
        criteria.to_csv(folder / "trust.csv", index=False, float_format="%.6g")
    of_each: dict[str, Callable[[Result], pd.DataFrame | None]] = {
        "events": lambda r: pd.DataFrame(r.estimate.events),
        "reprojection_classes": lambda r: r.evidence.patterns,
        "moved_points": lambda r: r.evidence.moved[r.evidence.moved["moved"]].drop(columns="moved"),
        "map_by_depth": lambda r: r.evidence.map_by_depth,
    }
    for name, of in of_each.items():
        parts = {r.name: part for r in run.answered if (part := of(r)) is not None and len(part)}
        if parts:
            joined = pd.concat(parts, names=["estimator"]).reset_index(level="estimator")
            joined.to_csv(folder / f"{name}.csv", index=False, float_format="%.6g")
    if run.held_out is not None and len(run.held_out.ranking):
        run.held_out.ranking.to_csv(folder / "held_out.csv", float_format="%.6g")
