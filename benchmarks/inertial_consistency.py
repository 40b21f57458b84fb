"""NEES of the 15 over simulated drives with raw inertial samples, `python -m benchmarks.inertial_consistency`.

Problems of tests/builders/inertial.py: 30 stereo tracks a frame without wrong matches, samples at 100 Hz, true noise,
and a start drawn from its covariance. The kernel is left out by default: it takes large Gaussian noise for wrong
matches. `waves` has an IMU ten times noisier than the simulator's. docs/consistency.md has the figures.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import click
import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from fgbaseline import compare, ekf, smoother
from fgbaseline.compare.consistency.anees import average_nees
from fgbaseline.geometry import strapdown
from tests.builders.inertial import inertial_problem, simulated_problem

PATHS = ("drone", "town", "waves")
FRAMES = 20


def states_nees(path: str, kernel: bool, seed: int) -> dict[str, pd.DataFrame]:
    """`compare.state_nees` of every estimator on one problem."""
    problem = inertial_problem(seed) if path == "waves" else simulated_problem(path, seed)  # type: ignore[arg-type]
    problem = problem if kernel else replace(problem, kernel=None)
    assert problem.sequence.truth is not None
    reference = smoother.isam2(problem)
    filters = ekf.dead_reckoning(problem), ekf.joint_ekf(problem)
    answers = (*filters, reference.by_products["isam2-online"], reference)
    return {estimate.name: compare.state_nees(estimate, problem.sequence.truth) for estimate in answers}


def row(runs: Sequence[pd.DataFrame]) -> list[str]:
    """Frames inside the bounds, lowest, highest and mean NEES of the 15, then the mean of each block."""
    whole = average_nees([run["state"].to_numpy() for run in runs], strapdown.STATE)
    at = whole.loc[np.linspace(1, len(whole) - 1, FRAMES).astype(int)]
    inside = int(((at["low"] <= at["anees"]) & (at["anees"] <= at["high"])).sum())
    blocks = [np.nanmean([run[name].to_numpy()[1:] for run in runs]) for name in runs[0].columns if name != "state"]
    figures = (at["anees"].min(), at["anees"].max(), whole["anees"].mean(), *blocks)
    return [str(inside), *(f"{value:.2f}" for value in figures)]


@click.command()
@click.option("--seeds", type=click.IntRange(min=2), default=50, show_default=True)
@click.option("--path", "paths", type=click.Choice(PATHS), multiple=True, default=PATHS, show_default=True)
@click.option("--kernel", is_flag=True, help="With the robust kernel, which takes large noise for wrong matches.")
@click.option("--jobs", type=click.IntRange(min=1), default=1, show_default=True)
def main(seeds: int, paths: tuple[str, ...], kernel: bool, jobs: int) -> None:
    """NEES of the 15 (pose, velocity, biases) and of its blocks of 3 over SEEDS problems of each path."""
    columns = (f"inside, of {FRAMES}", "lowest", "highest", "mean", "translation", "rotation", "velocity", "gyro bias")
    for path in paths:
        with ProcessPoolExecutor(jobs) as pool:
            runs = list(pool.map(partial(states_nees, path, kernel), range(seeds)))
        low, high = average_nees([run["isam2"]["state"].to_numpy() for run in runs], strapdown.STATE)[
            ["low", "high"]
        ].iloc[-1]
        table = Table("estimator", *columns, "accel bias", box=None, header_style="bold", pad_edge=False)
        for name in runs[0]:
            table.add_row(name, *row([run[name] for run in runs]))
        click.echo(f"{path}, {seeds} seeds; 95 % of the means lie in {low:.2f} to {high:.2f}")
        Console(width=140).print(table)


if __name__ == "__main__":
    main()
