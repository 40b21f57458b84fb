"""Speed of trajectory metrics beside evo's, in one run: `python -m benchmarks.metrics --repeat 3`.

Each row is one metric from arrays to its statistics, as a user of either library calls it. evo and this project take
turns, so that a machine that gets slower does so for both; both have to give the same figures to 1e-9, or the row
fails. evo's search of all pairs by angle builds Python lists over every pair of poses, which takes hours on 100,000 of
them: those rows have fewer poses, as their name says.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):  # before numpy: small matrices wait for each other in threads
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import contextlib
import io
import time
from collections.abc import Callable
from dataclasses import dataclass

import click
import numpy as np
from evo.core.metrics import APE, PE, RPE, StatisticsType
from evo.core.sync import associate_trajectories
from evo.core.trajectory import PoseTrajectory3D
from rich.console import Console
from rich.table import Table

from fgbaseline import compare, data
from fgbaseline.compare import Align, Unit
from fgbaseline.compare import PoseRelation as Relation
from fgbaseline.geometry import FloatArray, se3
from tests.builders.evo_metrics import OF_MOTIONS, OF_POSES, UNITS

DELTA = {Unit.FRAMES: 10, Unit.METERS: 10.0, Unit.DEGREES: 10.0}


@dataclass(frozen=True)
class Drive:
    t: FloatArray
    reference: FloatArray
    estimate: FloatArray


@dataclass(frozen=True)
class Row:
    name: str
    evo: Callable[[], float]
    ours: Callable[[], float]


def drive(n: int) -> Drive:
    """A drive of n poses at 10 Hz with turns, and an estimate that drifts away from it."""
    random = np.random.default_rng(0)
    twist = np.zeros((n - 1, 6))
    twist[:, 0] = 1.0
    twist[:, 5] = 0.03 * np.sin(np.arange(n - 1) / 40.0)
    reference = se3.compose(se3.exp(twist))
    estimate = se3.compose(se3.exp(twist + random.normal(size=twist.shape) * np.repeat([0.01, 0.0003], 3)))
    return Drive(np.linspace(0.0, 0.1 * (n - 1), n), reference, se3.exp([3.0, 2.0, 1.0, 0.1, 0.2, 0.3]) @ estimate)


def evo_pair(d: Drive) -> tuple[PoseTrajectory3D, PoseTrajectory3D]:
    paths = [PoseTrajectory3D(poses_se3=list(poses), timestamps=d.t) for poses in (d.reference, d.estimate)]
    matched: tuple[PoseTrajectory3D, PoseTrajectory3D] = associate_trajectories(*paths)
    return matched


def our_pair(d: Drive) -> compare.MatchedTrajectories:
    return compare.associate(data.Trajectory(d.t, d.reference), data.Trajectory(d.t, d.estimate))


def rmse_of(metric: PE, pair: tuple[PoseTrajectory3D, PoseTrajectory3D]) -> float:
    with contextlib.redirect_stdout(io.StringIO()):  # it shows its progress
        metric.process_data(pair)
    metric.get_all_statistics()
    return float(metric.get_statistic(StatisticsType.rmse))


def absolute_row(d: Drive, kind: Align, what: Relation) -> Row:
    def evo() -> float:
        reference, estimate = evo_pair(d)
        estimate.align(reference, correct_scale=kind is Align.SIM3)
        return rmse_of(APE(OF_POSES[what]), (reference, estimate))

    def ours() -> float:
        matched = our_pair(d).aligned(kind)
        poses, truth = matched.estimate.world_T_body, matched.reference.world_T_body
        return compare.summarized(compare.absolute_pose_error(poses, truth, what))["rmse"]

    return Row(f"ATE {kind}, {len(d.t):,} poses: {what}", evo, ours)


def relative_row(d: Drive, unit: Unit, all_pairs: bool, what: Relation) -> Row:
    delta = DELTA[unit]
    pair, matched = evo_pair(d), our_pair(d)  # as it is after the ATE: matched already

    def evo() -> float:
        metric = RPE(OF_MOTIONS[what], delta, UNITS[unit], all_pairs=all_pairs, pairs_from_reference=True)
        return rmse_of(metric, pair)

    def ours() -> float:
        pairs = compare.matched_pairs(matched, delta, unit, all_pairs=all_pairs)
        poses, truth = matched.estimate.world_T_body, matched.reference.world_T_body
        return compare.summarized(compare.relative_pose_error(poses, truth, pairs, what))["rmse"]

    which = "all pairs" if all_pairs else "consecutive"
    return Row(f"RPE {delta:g} {unit} {which}, {len(d.t):,} poses: {what}", evo, ours)


def rows(poses: int, turned: int) -> list[Callable[[], Row]]:
    """Makes of rows: a row holds evo's copy of the drive, of which one at a time is enough."""
    whole, part = drive(poses), drive(turned)
    found: list[Callable[[], Row]] = []
    for kind in (Align.SE3, Align.SIM3):
        found += [lambda k=kind, w=what: absolute_row(whole, k, w) for what in OF_POSES]  # type: ignore[misc]
    for unit in UNITS:
        for every in (False, True):
            d = part if unit is Unit.DEGREES and every else whole
            found += [
                lambda d=d, u=unit, a=every, w=what: relative_row(d, u, a, w)  # type: ignore[misc]
                for what in OF_MOTIONS
            ]
    return found


def timed(what: Callable[[], float]) -> tuple[float, float]:
    start = time.perf_counter()
    value = what()
    return value, time.perf_counter() - start


@click.command()
@click.option("--poses", type=click.IntRange(min=100), default=100_000, show_default=True)
@click.option("--turned", type=click.IntRange(min=100), default=1_000, show_default=True, help="Poses for all angles.")
@click.option("--repeat", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--only", default="", help="Rows whose name has this in it.")
def main(poses: int, turned: int, repeat: int, only: str) -> None:
    """Time every trajectory metric that evo has too, beside evo."""
    click.echo(f"{repeat} runs each; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    shown = Table(box=None, header_style="bold", pad_edge=False)
    shown.add_column("metric")
    for title in ("evo, s", "fgbaseline, s", "times faster", "from", "to"):
        shown.add_column(title, justify="right")
    least = np.inf
    for make in rows(poses, turned):
        row = make()
        if only not in row.name:
            continue
        seconds = np.empty((repeat, 2))
        for k in range(repeat):
            theirs, seconds[k, 0] = timed(row.evo)
            ours, seconds[k, 1] = timed(row.ours)
            if not np.isclose(ours, theirs, rtol=1e-9, atol=1e-9):
                raise click.ClickException(f"{row.name}: {ours!r} here, {theirs!r} by evo")
        ratio = seconds[:, 0] / seconds[:, 1]
        least = min(least, float(np.median(ratio)))
        median = np.median(seconds, axis=0)
        shown.add_row(
            row.name, f"{median[0]:.3f}", f"{median[1]:.4f}", *(f"{f(ratio):.1f}" for f in (np.median, np.min, np.max))
        )
    Console(width=120).print(shown)
    click.echo(f"The smallest of the median ratios is {least:.1f}.")


if __name__ == "__main__":
    main()
