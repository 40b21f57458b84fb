"""Speed of the estimators relative to each other: `python benchmarks/estimators.py drive.npz --repeat 5`.

The runs alternate, so that a machine that gets slower does so for all of them alike; what is compared is each one's
fastest run, which other work on the machine disturbs least. A figure is worth as much as the machine was idle.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):  # before numpy: small matrices wait for each other in threads
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import time
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from fgbaseline.data import Problem, Sequence, Status, find_estimator
from fgbaseline.geometry import FgbaselineError
from fgbaseline.reports.problem.construction import build_problem, read_sequence
from fgbaseline.reports.problem.settings import RunSettings, check_estimators


def seconds_taken(problem: Problem, name: str) -> float:
    """Wall-clock time of one answer. Raises ClickException where there is none."""
    solve = find_estimator(name)
    start = time.perf_counter()
    estimate = solve(problem, None)
    seconds = time.perf_counter() - start
    if estimate.status is Status.FAILED:
        raise click.ClickException(f"{name} failed: {estimate.reason}")
    return seconds


def table(sequence: Sequence, seconds: dict[str, list[float]]) -> Table:
    """A row for each estimator."""
    shown = Table(box=None, header_style="bold", pad_edge=False)
    shown.add_column("estimator")
    fastest = {name: min(runs) for name, runs in seconds.items()}
    first = next(iter(fastest.values()))
    duration = float(sequence.t[-1] - sequence.t[0])
    for title in ("fastest, s", "median, s", "slowest, s", "frames/s", "x real time", "to the first"):
        shown.add_column(title, justify="right")
    for name, runs in seconds.items():
        best = fastest[name]
        shown.add_row(
            name,
            *(f"{value:.3f}" for value in (best, float(np.median(runs)), max(runs))),
            f"{sequence.n_frames / best:,.0f}",
            f"{duration / best:.1f}",
            f"{best / first:.2f}",
        )
    return shown


@click.command()
@click.argument("recording", required=False, type=click.Path(path_type=Path))
@click.option("--estimators", default="dead-reckoning,ekf,isam2", show_default=True, help="Names, by commas.")
@click.option("--preset", type=click.Choice(["calibrated", "documented"]), default="calibrated", show_default=True)
@click.option("--repeat", type=click.IntRange(min=1), default=3, show_default=True)
def main(recording: Path | None, estimators: str, preset: str, repeat: int) -> None:
    """Time estimators on RECORDING, or on the simulated drive."""
    names = tuple(estimators.split(","))
    settings = RunSettings(sequence=recording, preset=preset, estimators=names)  # type: ignore[arg-type]
    try:
        check_estimators(names)
        sequence = read_sequence(settings)
    except FgbaselineError as error:
        raise click.ClickException(str(error)) from None
    problem = build_problem(sequence, settings)
    click.echo(
        f"{sequence.name}: {sequence.n_frames} frames, {len(problem.observations())} observations of "
        f"{len(problem.features)} landmarks; {repeat} runs each; load {os.getloadavg()[0]:.1f} on "
        f"{os.cpu_count()} cores"
    )
    seconds: dict[str, list[float]] = {name: [] for name in names}
    for _ in range(repeat):
        for name in names:
            seconds[name].append(seconds_taken(problem, name))
    Console(width=120).print(table(sequence, seconds))


if __name__ == "__main__":
    main()
