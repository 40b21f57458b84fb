"""Consistency of the estimators' covariances: NEES on simulated drives, `python benchmarks/consistency.py`.

Drives with turns, no wrong matches, and problems with the simulation's own noise. The mean over seeds of the
pose's NEES (6 degrees of freedom) lies inside its 95 % chi-square bounds at 19 of 20 frames, on average, for an
consistent estimator. docs/consistency.md explains the figures.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import click
import numpy as np
import pandas as pd
from matplotlib import pyplot as plt
from rich.console import Console
from rich.table import Table

from fgbaseline import compare, diagnosis, ekf, smoother
from fgbaseline.data import Estimate, HuberKernel, Problem, Sequence, Truth
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.diagnosis import AsRecordedSettings, NoiseSettings
from fgbaseline.diagnosis.tracks.observation_mask import MaskSettings
from fgbaseline.ekf import JointSettings, Linearization
from fgbaseline.reports.figures.style import ESTIMATOR_COLORS

FRAMES = 20
PARTS = 5
"""parts of the drive, over which growth is shown"""
EVERYTHING = MaskSettings(min_disparity=-np.inf, max_row_mismatch=np.inf, prediction_gate=np.inf, min_track=1)
"""There are no wrong matches to find, and a gate along noisy velocities would keep what agrees with their noise."""
INVERSE_DEPTH = JointSettings(linearization=Linearization.TEXTBOOK)
COLORS = {
    **ESTIMATOR_COLORS,
    "joint-ekf-first-estimate": "#56B4E9",
    "textbook, inverse depth": "#882255",
    "joint-ekf-textbook": "#D55E00",
}


@dataclass(frozen=True)
class Study:
    """Drives, and what their problems leave out or soften."""

    drive: Simulation
    preset_mask: bool
    kernel: bool

    def problem(self, sequence: Sequence) -> Problem:
        """Problem with the true noise and calibration of the simulation."""
        drive = self.drive
        return diagnosis.calibrated(
            sequence,
            settings=AsRecordedSettings(
                noise=NoiseSettings(drive.sigma_pixel, drive.sigma_linear, drive.sigma_angular),
                shift=Shift.AFTER,
                mask=MaskSettings() if self.preset_mask else EVERYTHING,
                kernel=HuberKernel() if self.kernel else None,
            ),
        )


def answers(problem: Problem) -> list[Estimate]:
    """Estimates of every estimator; the smoothers' from one run."""
    reference = smoother.isam2(problem)
    return [
        smoother.batch(problem, given={"isam2": reference}),
        reference,
        reference.by_products["isam2-online"],
        ekf.joint_ekf(problem),
        ekf.joint_ekf_first_estimate(problem),
        replace(ekf.joint_ekf(problem, settings=INVERSE_DEPTH), name="textbook, inverse depth"),
        ekf.joint_ekf_textbook(problem),
    ]


def one_drive(study: Study, seed: int) -> tuple[list[Estimate], Truth, float]:
    """The answers to one drive, its truth, and the seconds they took."""
    sequence = simulate(replace(study.drive, seed=seed))
    assert sequence.truth is not None
    start = time.process_time()
    found = answers(study.problem(sequence))
    return found, sequence.truth, time.process_time() - start


def consistency(runs: Iterable[tuple[list[Estimate], Truth, float]]) -> dict[str, pd.DataFrame]:
    """`compare.anees` of every estimator."""
    by_name: dict[str, list[tuple[Estimate, Truth]]] = {}
    for found, truth, _ in runs:
        for estimate in found:
            by_name.setdefault(estimate.name, []).append((estimate, truth))
    return {name: compare.anees(pairs) for name, pairs in by_name.items()}


def fixed_frames(n_frames: int) -> np.ndarray:
    """Evenly spaced up to the last; frame 0 is held and has no NEES."""
    return np.linspace(0, n_frames - 1, FRAMES + 1).round().astype(int)[1:]


def shown(tables: dict[str, pd.DataFrame], rmse: dict[str, float]) -> Table:
    """A row for each estimator."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("estimator")
    for title in (
        f"inside, of {FRAMES}",
        "lowest",
        "highest",
        "mean",
        *(f"part {i + 1}" for i in range(PARTS)),
        "RMSE, m",
    ):
        table.add_column(title, justify="right")
    for name, frames in tables.items():
        at = frames.loc[fixed_frames(len(frames))]
        inside = int(((at["low"] <= at["anees"]) & (at["anees"] <= at["high"])).sum())
        parts = [part.mean() for part in np.array_split(frames["anees"].to_numpy()[1:], PARTS)]
        figures = (at["anees"].min(), at["anees"].max(), frames["anees"].mean(), *parts)
        table.add_row(name, str(inside), *(f"{value:.2f}" for value in figures), f"{rmse[name]:.3f}")
    return table


def rmse_of_position(runs: list[tuple[list[Estimate], Truth, float]]) -> dict[str, float]:
    """Over all frames and seeds, m, without alignment."""
    squares: dict[str, list[float]] = {}
    for found, truth, _ in runs:
        for estimate in found:
            error = compare.truth_errors(estimate, truth)["position"]
            squares.setdefault(estimate.name, []).append(float((error**2).mean()))
    return {name: float(np.sqrt(np.mean(each))) for name, each in squares.items()}


def draw(tables: dict[str, pd.DataFrame], seconds_a_frame: float, title: str, path: Path) -> None:
    """The mean NEES over time, smoothers above and filters below."""
    smoothers = ("batch", "isam2", "isam2-online")
    names: tuple[Callable[[str], bool], ...] = (lambda name: name in smoothers, lambda name: name not in smoothers)
    figure, axes = plt.subplots(2, 1, figsize=(10.0, 6.4), sharex=True, layout="constrained")
    for ax, chosen in zip(axes, names, strict=True):
        for name in filter(chosen, tables):
            table = tables[name]
            style = "--" if name == "isam2" else "-"
            ax.plot(table.index * seconds_a_frame, table["anees"], style, label=name, color=COLORS[name], linewidth=1.3)
            at = table.loc[fixed_frames(len(table)), "anees"]
            ax.plot(at.index * seconds_a_frame, at, "o", color=COLORS[name], markersize=3.5)
        ax.axhspan(table["low"].iloc[-1], table["high"].iloc[-1], color="#d7e8d9", zorder=0, label="95 % bounds")
        ax.axhline(6.0, color="#6b9a72", linewidth=0.9, zorder=0.5)
        ax.set_ylabel("mean NEES of the pose")
        if max(tables[name]["anees"].max() for name in filter(chosen, tables)) > 20.0:
            ax.set_yscale("log")
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9)
        ax.margins(x=0.01)
        ax.spines[["top", "right"]].set_visible(False)
    axes[1].set_xlabel("time, s")
    figure.suptitle(title, fontsize=11)
    figure.savefig(path, dpi=130)


@click.command()
@click.option("--seeds", type=click.IntRange(min=2), default=50, show_default=True)
@click.option("--path", type=click.Choice(["town", "loop", "highway", "handheld"]), default="town", show_default=True)
@click.option("--duration", type=float, default=25.0, show_default=True, help="Seconds, at 10 frames each.")
@click.option("--features", type=float, default=35.0, show_default=True, help="A frame, on average.")
@click.option("--linear", type=float, default=0.1, show_default=True, help="m/s, noise of a velocity sample.")
@click.option("--angular", type=float, default=0.01, show_default=True, help="rad/s, noise of a rate sample.")
@click.option("--mask", is_flag=True, help="With the preset's mask, which takes what disagrees for wrong.")
@click.option("--kernel", is_flag=True, help="With the preset's robust kernel, which takes large noise for wrong.")
@click.option("--jobs", type=click.IntRange(min=1), default=1, show_default=True)
@click.option("--figure", type=click.Path(path_type=Path), help="Where to draw the NEES over time.")
def main(
    seeds: int,
    path: str,
    duration: float,
    features: float,
    linear: float,
    angular: float,
    mask: bool,
    kernel: bool,
    jobs: int,
    figure: Path | None,
) -> None:
    """NEES of every estimator over SEEDS simulated drives."""
    drive = Simulation(
        path=path,  # type: ignore[arg-type]
        duration=duration,
        features_per_frame=features,
        sigma_linear=linear,
        sigma_angular=angular,
        wrong_share=0.0,
    )
    with ProcessPoolExecutor(jobs) as pool:
        runs = list(pool.map(partial(one_drive, Study(drive, mask, kernel)), range(seeds)))
    tables = consistency(runs)
    one = next(iter(tables.values()))
    title = f"{seeds} drives ({path}, {duration:g} s, {features:g} features, {linear:g} m/s, {angular:g} rad/s)"
    click.echo(f"{title}; 95 % of the means lie in {one['low'].iloc[-1]:.2f} to {one['high'].iloc[-1]:.2f}")
    Console(width=140).print(shown(tables, rmse_of_position(runs)))
    click.echo(f"{sum(seconds for *_, seconds in runs):.0f} s of CPU time")
    if figure is not None:
        draw(tables, 1.0 / drive.rate, title, figure)


if __name__ == "__main__":
    main()
