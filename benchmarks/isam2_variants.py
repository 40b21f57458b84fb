"""Variants of iSAM2 for speed, with their effect on the answer: `python -m benchmarks.isam2_variants FILE...`.

Each variant solves the same problem in turn. Printed are processor time, the share of it in GTSAM's updates, and how
far final and online paths are from those of the variant that relinearizes at every update.
"""

import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import click
import gtsam
import numpy as np

from fgbaseline import data, diagnosis, smoother
from fgbaseline.data import Estimate, Problem, Status
from fgbaseline.geometry import FloatArray
from fgbaseline.smoother.initialization.initial_values import restricted_problem
from fgbaseline.smoother.isam2 import elimination_ordering
from fgbaseline.smoother.isam2.elimination_ordering import EliminationOrdering
from fgbaseline.smoother.isam2.settings import ISAM2Settings

from .gtsam_time import INCREMENTAL, gtsam_timed

EVERY = ISAM2Settings(relinearize_skip=1, relinearize_all_skip=1)


class PartialCheck(ISAM2Settings):
    """Looks for variables to relinearize from the root of the tree down, no further than they moved."""

    def params(self, baseline: float) -> gtsam.ISAM2Params:
        params = super().params(baseline)
        params.enablePartialRelinearizationCheck = True
        return params


@dataclass(frozen=True, slots=True)
class Variant:
    """A way of solving a problem."""

    name: str
    solve: Callable[[Problem], Estimate]


def isam2(settings: ISAM2Settings) -> Callable[[Problem], Estimate]:
    return lambda problem: smoother.isam2(problem, settings=settings)


def at_every(frames: int) -> Callable[[Problem], Estimate]:
    """All of the tree is relinearized, at each of so many frames."""
    return isam2(ISAM2Settings(relinearize_skip=frames, relinearize_all_skip=frames))


def landmarks_first(problem: Problem) -> Estimate:
    with crowds_above(0):
        return smoother.isam2(problem, settings=EVERY)


def keyframes(problem: Problem) -> Estimate:
    """Every second frame is blind: its pose stays, tied by the velocities."""
    return smoother.isam2(restricted_problem(problem, problem.mask & (problem.sequence.observations.frame % 2 == 0)))


@contextmanager
def crowds_above(landmarks: int) -> Iterator[None]:
    before, elimination_ordering.MANY_LANDMARKS = elimination_ordering.MANY_LANDMARKS, landmarks
    try:
        yield
    finally:
        elimination_ordering.MANY_LANDMARKS = before


def by_colamd(problem: Problem) -> Estimate:
    """All that an update touches is ordered by COLAMD, but for what the new factors name, which is last."""
    before = EliminationOrdering.groups

    def latest_last(self: EliminationOrdering, frame: int, landmarks: Collection[int], **_: int) -> dict[int, int]:
        return before(self, frame, landmarks, all_new=True)

    EliminationOrdering.groups = latest_last  # type: ignore[method-assign]
    try:
        return smoother.isam2(problem)
    finally:
        EliminationOrdering.groups = before  # type: ignore[method-assign]


VARIANTS = (
    Variant("relinearized at every update", isam2(EVERY)),
    Variant("at every second", at_every(2)),
    Variant("at every third (the default)", isam2(ISAM2Settings())),
    Variant("the last 10 frames at every third, all at every fifteenth", isam2(ISAM2Settings(relinearize_all_skip=15))),
    Variant("the default, in the order of COLAMD", by_colamd),
    Variant("at every fifth", at_every(5)),
    Variant(
        "at every one, thresholds 2.5 times as large",
        isam2(
            replace(
                EVERY,
                **{
                    name: 2.5 * getattr(EVERY, name)
                    for name in ("relinearize_position", "relinearize_rotation", "relinearize_landmark")
                },
            )
        ),
    ),
    Variant(
        "at every one, checked from the root down", isam2(PartialCheck(relinearize_skip=1, relinearize_all_skip=1))
    ),
    Variant("at every one, landmarks eliminated before the pose", landmarks_first),
    Variant("at every one, by QR", isam2(replace(EVERY, qr=True))),
    Variant("the default, every second frame without observations", keyframes),
    Variant("landmarks leave: `fixed-lag`", smoother.fixed_lag),
)


def row(variant: Variant, problem: Problem, first: Estimate | None) -> tuple[str, Estimate]:
    with gtsam_timed() as spent:
        start = time.process_time()
        estimate = variant.solve(problem)
        seconds = time.process_time() - start
    if estimate.status is Status.FAILED:
        return f"| {variant.name} | {seconds:.1f} | | failed: {estimate.reason} | |", estimate
    apart = ["", ""]
    if first is not None:
        apart = [_apart(estimate, first), _apart(_online(estimate), _online(first))]
    share = spent.seconds[INCREMENTAL] / seconds
    return f"| {variant.name} | {seconds:.1f} | {share:.0%} | {apart[0]} | {apart[1]} |", estimate


def _online(estimate: Estimate) -> Estimate | None:
    return estimate.by_products.get("isam2-online")


def _apart(a: Estimate | None, b: Estimate | None) -> str:
    if a is None or b is None:
        return ""
    difference: FloatArray = a.world_T_imu[:, :3, 3] - b.world_T_imu[:, :3, 3]
    return f"{np.sqrt(np.mean(np.sum(difference**2, axis=1))):.4f}"


@click.command()
@click.argument("recordings", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
def main(recordings: tuple[Path, ...]) -> None:
    """Print a table for each recording."""
    for recording in recordings:
        problem = diagnosis.calibrated(data.read(recording))
        click.echo(f"\n{recording.name}:\n\n| variant | s | in updates | final path, m | online path, m |")
        click.echo("|---|---|---|---|---|")
        first: Estimate | None = None
        for variant in VARIANTS:
            text, estimate = row(variant, problem, first)
            click.echo(text)
            first = first or estimate


if __name__ == "__main__":
    main()
