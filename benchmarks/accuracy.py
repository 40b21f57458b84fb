"""Accuracy and consistency of every estimator on the recordings that have truth: `python benchmarks/accuracy.py`.

ATE is the RMSE of position after SE(3) alignment, NEES the mean over frames of the pose's (6 expected of a consistent
estimator). Each recording is posed as the diagnosis repairs it and as it was recorded. Figures of two versions of the
code compare with `--before`: the JSON of the other one.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from fgbaseline import compare, data, diagnosis
from fgbaseline.data import Estimate, Problem, Sequence, Status, estimator_names
from fgbaseline.data.estimators.runner import solve_all
from fgbaseline.diagnosis import AsRecordedSettings

RECORDINGS = Path(os.environ.get("FGBASELINE_RECORDINGS", Path(__file__).parents[2] / "shared" / "data"))
KITTI_07 = ("ece276a_2020/0027.npz", "ground_truth/kitti_odometry_07.txt")
"""a recording without truth, and its truth: poses of the left camera"""
POSED = {"diagnosed": None, "as recorded": AsRecordedSettings()}
"""the settings of `diagnosis.calibrated`"""
FIRST = ("dead-reckoning", "isam2", "isam2-online", "batch")
"""in this order, so that iSAM2 runs once"""
Figures: TypeAlias = dict[str, float | int | str | None]


def sequences(folder: Path) -> Iterator[Sequence]:
    """Every recording with truth in the folder of recordings."""
    for file in sorted((folder / "utias").glob("*.mat")):
        yield data.read(file)
    recording, truth = (folder / name for name in KITTI_07)
    if recording.is_file() and truth.is_file():
        yield data.read(recording, truth, "camera")


def figures(problem: Problem, estimate: Estimate) -> Figures:
    """The figures of one answer; None for what it does not have."""
    truth = problem.sequence.truth
    assert truth is not None
    if estimate.status is Status.FAILED:
        return {"status": str(estimate.status), "reason": estimate.reason}
    nees = compare.nees(estimate, truth)
    known = np.isfinite(nees)
    offered = len(problem.observations())
    return {
        "status": str(estimate.status),
        "reason": estimate.reason,
        "ate_m": compare.summarized(compare.truth_errors(estimate, truth, aligned=True)["position"])["rmse"],
        "rmse_m": compare.summarized(compare.truth_errors(estimate, truth)["position"])["rmse"],
        "nees": float(nees[known].mean()) if known.any() else None,
        "nees_median": float(np.median(nees[known])) if known.any() else None,
        "offered": offered,
        "rejected": offered - int(np.count_nonzero(estimate.used)),
        "landmarks": len(estimate.landmarks),
        "landmark_rmse_m": landmark_error(estimate, problem.sequence),
        "seconds": estimate.seconds_total,
    }


def landmark_error(estimate: Estimate, sequence: Sequence) -> float | None:
    """RMSE of the landmarks' positions in the world, m, where the truth has them."""
    truth = sequence.truth
    if truth is None or truth.landmarks is None or len(estimate.landmarks) == 0:
        return None
    difference = estimate.landmarks.position - truth.landmarks[estimate.landmarks.index]
    return float(np.sqrt(np.nanmean((difference**2).sum(axis=1))))


def shown(found: dict[str, dict[str, Figures]], before: dict[str, dict[str, Figures]]) -> Table:
    """A row for each estimator on each problem; in brackets what it was before."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("recording")
    table.add_column("estimator")
    for title in ("ATE, m", "NEES", "offered", "rejected", "seconds"):
        table.add_column(title, justify="right")
    for recording, estimators in found.items():
        for name, now in estimators.items():
            then = before.get(recording, {}).get(name, {})
            cells = [cell(now, then, key, form) for key, form in (("ate_m", ".4f"), ("nees", ".2f"))]
            cells += [cell(now, then, key, ",d") for key in ("offered", "rejected")]
            table.add_row(recording, name, *cells, cell(now, then, "seconds", ".1f"))
    return table


def cell(now: Figures, then: Figures, key: str, form: str) -> str:
    """A figure, and what it was before."""
    value, old = now.get(key), then.get(key)
    text = "-" if value is None else format(value, form)
    return text if old is None else f"{text} ({format(old, form)})"


@click.command()
@click.option("--recordings", type=click.Path(exists=True, file_okay=False, path_type=Path), default=RECORDINGS)
@click.option("--only", default="", help="Only recordings with this in their name.")
@click.option("--estimators", default="", help="Names, by commas; all that are installed without it.")
@click.option("--out", type=click.Path(path_type=Path), help="JSON file for the figures.")
@click.option("--before", type=click.Path(exists=True, path_type=Path), help="JSON file of other figures to show.")
def main(recordings: Path, only: str, estimators: str, out: Path | None, before: Path | None) -> None:
    """ATE, NEES and rejected observations of every estimator on every recording with truth."""
    names = estimators.split(",") if estimators else estimator_names()
    names = [*(name for name in FIRST if name in names), *(name for name in names if name not in FIRST)]
    found: dict[str, dict[str, Figures]] = {}
    for sequence in sequences(recordings):
        if only not in sequence.name:
            continue
        for posed, settings in POSED.items():
            start = time.monotonic()
            problem = diagnosis.calibrated(sequence, settings=settings)
            answers = solve_all(problem, names)
            found[f"{sequence.name}, {posed}"] = {name: figures(problem, answers[name]) for name in names}
            click.echo(f"{sequence.name}, {posed}: {time.monotonic() - start:.0f} s", err=True)
            if out is not None:
                out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    then = {} if before is None else json.loads(before.read_text(encoding="utf-8"))
    Console(width=140).print(shown(found, then))


if __name__ == "__main__":
    main()
