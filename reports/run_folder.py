"""What a run leaves behind: tables, trajectories, figures and the page."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fgbaseline.compare import reprojection_by
from fgbaseline.data import Estimate, write_tum

from . import figures, html
from .comparison import Result, Run
from .job import MARK
from .run_tables import consistency_series, write_tables
from .schema import Summary
from .summary import metrics_table, summarise

TRUTH_FILE = "truth.tum"


def write_run(run: Run, folder: Path, processes: int = 1) -> Summary:
    """Writes every file of DESIGN's run folder into an existing, empty folder; gives the summary.

    `processes` share the drawing of the figures. A caller that is one of several processes at work leaves it at one.
    """
    with figures.being_drawn(run, processes) as finished:
        summary = write_numbers(run, folder)
        drawn = finished()
    (folder / "figures").mkdir()
    figures.save(drawn, folder / "figures")
    write_page(run, summary, folder, drawn)
    return summary


def write_numbers(run: Run, folder: Path) -> Summary:
    """The same without figures and page."""
    summary = summarise(run)
    for name in ("trajectories", "landmarks", "series", "tables"):
        (folder / name).mkdir()
    for name, result in run.results.items():
        nine_digits(series(run, result)).to_csv(folder / "series" / f"{name}.csv")
        if result.answered:
            write_tum(folder / "trajectories" / f"{name}.tum", run.problem.sequence.t, result.estimate.world_T_imu)
            write_landmarks(folder / "landmarks" / f"{name}.csv", run, result.estimate)
    truth = run.problem.sequence.truth
    if truth is not None:
        write_tum(folder / TRUTH_FILE, run.problem.sequence.t, truth.world_T_imu)
    write_tables(run, folder / "tables")
    metrics_table(summary).to_csv(folder / "metrics.csv", index=False)
    text = json.dumps(_as_dict(summary), indent=2, allow_nan=False)
    (folder / MARK).write_text(f"{text}\n", encoding="utf-8")
    return summary


def nine_digits(table: pd.DataFrame) -> pd.DataFrame:
    """The table with its floats as text, empty where they have no number: pandas asks of each on its own what it is."""
    text = {
        str(name): [f"{value:.9g}" if value == value else "" for value in column.tolist()]
        for name, column in table.items()
        if column.dtype.kind == "f"
    }
    return table.assign(**text)


def write_page(run: Run, summary: Summary, folder: Path, drawn: Mapping[str, Figure | figures.Written]) -> None:
    """`report.html`, with the figures that were drawn."""
    (folder / "report.html").write_text(html.render(run, _as_dict(summary), drawn), encoding="utf-8")


def _as_dict(summary: Summary) -> dict[str, Any]:
    return summary.model_dump(mode="json", by_alias=True)


def write_landmarks(path: Path, run: Run, estimate: Estimate) -> None:
    """id,x,y,z,n_used of every landmark of an estimate, m, in the world frame."""
    landmarks = estimate.landmarks
    used = run.problem.sequence.observations.landmark[estimate.used]
    n_used = np.bincount(used, minlength=run.problem.sequence.n_landmarks)[landmarks.index]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["id", "x", "y", "z", "n_used"])
        for index, position, n in zip(landmarks.index.tolist(), landmarks.position.tolist(), n_used, strict=True):
            writer.writerow([index, *position, int(n)])


def series(run: Run, result: Result) -> pd.DataFrame:
    """One row per frame: time stamp, divergence, error to truth, reprojection, NEES and seconds spent."""
    T = run.problem.n_frames
    stamps = [repr(t) for t in run.problem.sequence.t.tolist()]  # in full: nine digits of a Unix time are seconds
    table = pd.DataFrame({"t": stamps}, index=pd.RangeIndex(T, name="frame"))
    for prefix, errors in (("divergence", result.divergence), ("truth", result.truth)):
        if errors is not None:
            table = table.join(errors.add_prefix(f"{prefix}_"))
    table = table.join(reprojection_by(result.reprojection, "frame").add_prefix("reprojection_"))
    table = table.join(consistency_series(result))
    table["seconds"] = result.estimate.seconds if len(result.estimate.seconds) == T else np.nan
    return table
