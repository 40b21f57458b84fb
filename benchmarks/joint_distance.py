"""Distance of the joint filter from iSAM2, by its causes: `python benchmarks/joint_distance.py FILE...`.

Each row changes one thing. `isam2-online` has the same data as a filter: the rest of the way to `isam2` is what only
later frames add. iSAM2 that never moves a linearization point is a filter as far as linearization goes, on the very
graph that iSAM2 solves: from there to `isam2-online` it is linearization and nothing else.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from fgbaseline import compare, data, diagnosis, ekf, smoother
from fgbaseline.data import Estimate, Excluded, Problem, Sequence, Status
from fgbaseline.ekf import JointSettings, Linearization
from fgbaseline.smoother import ISAM2Settings

NEVER = 1e9
"""a threshold that no step passes"""
FACTORS = (0.5, 2.0)
"""factors by which the assumed noise is too small and too large"""


@dataclass(frozen=True)
class Step:
    """An answer with one thing changed, and what it is held against."""

    group: str
    name: str
    estimate: Estimate
    online: Estimate
    final: Estimate


def online(problem: Problem, settings: ISAM2Settings | None = None) -> tuple[Estimate, Estimate]:
    """Estimates of iSAM2 online and in the end."""
    final = smoother.isam2(problem, settings=settings)
    if final.status is Status.FAILED:
        raise click.ClickException(f"{problem.sequence.name}: isam2 failed: {final.reason}")
    return final.by_products["isam2-online"], final


def steps(problem: Problem) -> Iterator[Step]:
    """Default first; then linearization, what takes part, weighting and gating, noise."""
    known, final = online(problem)
    fixed = ISAM2Settings(relinearize_position=NEVER, relinearize_rotation=NEVER, relinearize_landmark=NEVER)

    def joint(posed: Problem, **settings: object) -> Estimate:
        return ekf.joint_ekf(posed, settings=JointSettings(**settings))  # type: ignore[arg-type]

    yield Step("", "isam2-online", known, known, final)
    yield Step("", "joint-ekf", joint(problem), known, final)
    yield Step("linearization", "isam2-online that never relinearizes", online(problem, fixed)[0], known, final)
    for way in (Linearization.FIRST_ESTIMATE, Linearization.TEXTBOOK):
        yield Step("linearization", f"joint-ekf, {way}", joint(problem, linearization=way), known, final)
    yield Step("linearization", "joint-ekf, textbook, world", ekf.joint_ekf_textbook(problem), known, final)
    yield Step(
        "same data", "joint-ekf on what isam2 used", joint(restricted_problem(problem, final.used)), known, final
    )
    if problem.kernel is not None:
        plain = replace(problem, kernel=None)
        known_plain, final_plain = online(plain)
        yield Step("kernel", "isam2-online without kernel", known_plain, known, final)
        yield Step("kernel", "joint-ekf without kernel", joint(plain), known, final)
        yield Step("kernel", "the same, from isam2 without kernel", joint(plain), known_plain, final_plain)
    yield Step("gating", "joint-ekf-ungated", ekf.joint_ekf_ungated(problem), known, final)
    yield Step("gating", "joint-ekf, every frame believed", joint(problem, disagreeing_share=None), known, final)
    for factor in FACTORS:
        pixels = replace(problem, pixel_variance=problem.pixel_variance * factor**2)
        yield Step("noise", f"joint-ekf, pixels {factor:g} times", joint(pixels), known, final)
        motion = replace(problem, increment_covariance=problem.increment_covariance * factor**2)
        yield Step("noise", f"joint-ekf, velocities {factor:g} times", joint(motion), known, final)
    yield Step("bias", "joint-ekf-bias", ekf.joint_ekf_bias(problem), known, final)


def restricted_problem(problem: Problem, used: np.ndarray) -> Problem:
    """The problem with only the observations `used` (n,)."""
    excluded = np.where(used, Excluded.NO, np.maximum(problem.excluded, Excluded.GEOMETRY)).astype(np.uint8)
    left = np.unique(problem.sequence.observations.landmark[used])
    return replace(problem, excluded=excluded, features=left)


def shown(sequence: Sequence, found: Iterator[Step]) -> Table:
    """A row for each step."""
    table = Table(box=None, header_style="bold", pad_edge=False, title=sequence.name, title_justify="left")
    table.add_column("what")
    table.add_column("changed")
    for title in ("from online, m", "at the end, m", "from isam2, m", "ATE, m", "used, %", "frames given up"):
        table.add_column(title, justify="right")
    for step in found:
        apart = compare.divergence_summary(compare.divergence(step.estimate, step.online))
        beyond = compare.divergence_summary(compare.divergence(step.estimate, step.final))
        given_up = sum(event.kind == data.EventKind.FRAME_DISAGREES for event in step.estimate.events)
        table.add_row(
            step.name,
            step.group,
            f"{apart['rmse']:.3f}",
            f"{apart['final']:.3f}",
            f"{beyond['rmse']:.3f}",
            ate(step.estimate, sequence),
            f"{100.0 * step.estimate.used.mean():.1f}",
            f"{given_up}" if given_up else "",
        )
    return table


def ate(estimate: Estimate, sequence: Sequence) -> str:
    """RMSE of position after SE(3) alignment; a dash without truth."""
    if sequence.truth is None:
        return "-"
    return f"{compare.summarized(compare.truth_errors(estimate, sequence.truth, aligned=True)['position'])['rmse']:.3f}"


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--truth", type=click.Path(exists=True, path_type=Path), help="For recordings that bring none.")
@click.option("--truth-frame", type=click.Choice(["camera", "imu"]), default=None)
def main(files: tuple[Path, ...], truth: Path | None, truth_frame: str | None) -> None:
    """Split the joint filter's distance from isam2."""
    for file in files:
        sequence = data.read(file, truth, truth_frame)  # type: ignore[arg-type]
        Console(width=140).print(shown(sequence, steps(diagnosis.calibrated(sequence))))


if __name__ == "__main__":
    main()
