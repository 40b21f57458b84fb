"""Distance of iSAM2 from batch, with and without final relinearization: `python benchmarks/isam2_vs_batch.py FILE...`.

Costs are those of `compare.cost`, over the observations that batch used, so that they compare. Exits 1 where a limit
is passed: 0.05 m between the paths, and a cost above batch's by 0.01 % without a kernel, by 0.5 % with one.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from fgbaseline import compare, data, diagnosis, smoother
from fgbaseline.compare import cost
from fgbaseline.data import Estimate, Problem, Sequence, Status
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.smoother import ISAM2Settings

MAX_RMSE = 0.05
"""m"""
MAX_EXCESS = {True: 5e-3, False: 1e-4}
"""largest excess of the cost over batch's, as a share, with and without a kernel"""
DRIVES: tuple[PathName, ...] = ("town", "loop", "highway", "handheld")


def recordings(files: tuple[Path, ...]) -> Iterator[Sequence]:
    """Recordings in the named files, or without files simulated drives."""
    if files:
        yield from map(data.read, files)
    else:
        yield from (simulate(Simulation(path=path, duration=30.0)) for path in DRIVES)


def row(problem: Problem) -> tuple[list[str], bool]:
    """Figures of the three answers, and whether iSAM2 holds the limits before and after its relinearization."""
    before = smoother.isam2(problem, settings=ISAM2Settings(relinearize_at_end=False))
    after = smoother.isam2(problem)
    batch = smoother.batch(problem, given={"isam2": after})
    for estimate in (before, after, batch):
        if estimate.status is Status.FAILED:
            return [f"{estimate.name} failed: {estimate.reason}"], False
    lowest = cost(problem, batch, batch.used)
    excess = [cost(problem, estimate, batch.used) / lowest - 1.0 for estimate in (before, after)]
    apart = [rmse(estimate, batch) for estimate in (before, after)]
    holds = max(apart) < MAX_RMSE and max(excess) < MAX_EXCESS[problem.kernel is not None]
    figures = [
        f"{batch.used.sum()}",
        *(f"{value:.4f}" for value in apart),
        f"{lowest:.7g}",
        *(f"{100.0 * value:+.5f}" for value in excess),
        two_starts(batch),
        "yes" if holds else "NO",
    ]
    return figures, holds


def rmse(estimate: Estimate, batch: Estimate) -> float:
    """RMSE of position, m, without alignment."""
    return compare.divergence_summary(compare.divergence(estimate, batch))["rmse"]


def two_starts(batch: Estimate) -> str:
    """Event of batch on its two starts."""
    texts = {data.EventKind.SAME_COST: "same", data.EventKind.DIFFERENT_COSTS: "differ"}
    return next((text for event in batch.events for kind, text in texts.items() if event.kind == kind), "one only")


@click.command()
@click.argument("files", nargs=-1, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--kernels", type=click.Choice(["both", "with", "without"]), default="both", show_default=True)
def main(files: tuple[Path, ...], kernels: str) -> None:
    """Compare isam2 and batch on recordings, or on simulated drives."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in ("recording", "kernel", "used"):
        table.add_column(title)
    for title in ("RMSE before, m", "after, m", "cost of batch", "before, %", "after, %", "starts", "holds"):
        table.add_column(title, justify="right")
    all_hold = True
    for sequence in recordings(files):
        posed = diagnosis.calibrated(sequence)
        variants = {"with": posed, "without": replace(posed, kernel=None)}
        for kernel, problem in variants.items():
            if kernels in ("both", kernel):
                figures, holds = row(problem)
                table.add_row(sequence.name, kernel, *figures)
                all_hold &= holds
                click.echo(f"{sequence.name}, {kernel} kernel: {' '.join(figures)}", err=True)
    Console(width=150).print(table)
    sys.exit(0 if all_hold else 1)


if __name__ == "__main__":
    main()
