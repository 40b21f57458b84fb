"""Speed of the reference, and the share of GTSAM in it: `python -m benchmarks.reference_speed drive.npz`."""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import time
from pathlib import Path

import click
import numpy as np

from fgbaseline import data, diagnosis, smoother
from fgbaseline.data import Estimate, Problem, Status
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.data.velocity_increments import Shift
from fgbaseline.diagnosis import AsRecordedSettings, NoiseSettings

from .claim_table import Row, row, table
from .gtsam_time import INCREMENTAL, OTHER, gtsam_timed

MOST_OUTSIDE = 25.0
"""%"""
LEAST_REAL_TIME = 4.0
MOST_GROWTH = 1.2
DRIVE_FRAMES, EARLY = 3000, 300
LAPS_AT_END = 3
"""long enough for an exchange of the tree to be among them"""
FEATURES = 30.0
"""a frame of these drives: the fewer, the more shows of what grows with the drive"""


def rows(recording: Path | None, runs: int, frames: int = DRIVE_FRAMES) -> list[Row]:
    """Requirements on `isam2`: on a recording, where there is one, and on simulated drives, a new one each run."""
    return [*([] if recording is None else on_recording(recording, runs)), late_against_early(runs, frames)]


def on_recording(recording: Path, runs: int) -> list[Row]:
    """Times real time, and the shares of GTSAM's calls in processor time."""
    problem = diagnosis.calibrated(data.read(recording))
    duration = float(problem.sequence.t[-1] - problem.sequence.t[0])
    real_time, shares = [], []
    for _ in range(runs):
        start = time.perf_counter()
        solved(problem)
        real_time.append(duration / (time.perf_counter() - start))
        shares.append(_shares(problem))
    update, other = (np.array(values) for values in zip(*shares, strict=True))
    name = f"isam2 on {recording.name}"
    outside = 1.0 - update
    return [
        row(f"{name}: real time", real_time, " times", least=LEAST_REAL_TIME),
        row(f"{name}: share outside {INCREMENTAL}", 100.0 * outside, "%", most=MOST_OUTSIDE),
        row(f"of that, {OTHER} (covariances, copies, last relinearization)", 100.0 * other, "%"),
        row("of that, ours (Python, numpy, building factors)", 100.0 * (outside - other), "%"),
    ]


def _shares(problem: Problem) -> tuple[float, float]:
    """Shares of iSAM2's updates and estimates, and of GTSAM's other calls, in the CPU time of a whole answer."""
    with gtsam_timed() as spent:
        start = time.process_time()
        solved(problem)
        whole = time.process_time() - start
    return spent.seconds[INCREMENTAL] / whole, spent.seconds[OTHER] / whole


def late_against_early(runs: int, frames: int = DRIVE_FRAMES) -> Row:
    """The cost of a frame at the end of a simulated drive, over its last laps, against the lap around frame 300.

    The drive goes round a block at constant speed, and whole laps are compared: on a road that changes, the scene shows
    more than the frame's number. No landmark comes back once it was lost, so nothing closes a loop.
    """
    ratios, last = [], min(LAPS_AT_END, frames // EARLY - 1) * EARLY
    for seed in range(runs):
        seconds = solved(long_drive(frames, seed)).seconds
        late = np.mean(seconds[-last:])
        ratios.append(float(late / np.mean(seconds[EARLY // 2 : EARLY + EARLY // 2])))
    what = f"isam2, a frame at the end of {frames} against frame {EARLY} ({FEATURES:.0f} features a frame, no loops)"
    return row(what, ratios, " times", most=MOST_GROWTH)


def long_drive(frames: int, seed: int) -> Problem:
    """A simulated drive round a block, a lap each `EARLY` frames, with the noise that it has."""
    simulation = Simulation(
        path="loop",
        duration=frames / 10.0,
        return_after=EARLY / 10.0,  # a lap; nothing returns
        features_per_frame=FEATURES,
        returning_share=0.0,
        seed=seed,
    )
    noise = NoiseSettings(simulation.sigma_pixel, simulation.sigma_linear, simulation.sigma_angular)
    return diagnosis.calibrated(simulate(simulation), settings=AsRecordedSettings(noise, shift=Shift.AFTER))


def solved(problem: Problem) -> Estimate:
    """The answer of isam2; raises RuntimeError where there is none."""
    estimate = smoother.isam2(problem)
    if estimate.status is Status.FAILED:
        raise RuntimeError(f"isam2 failed: {estimate.reason}")
    return estimate


@click.command()
@click.argument("recording", required=False, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--runs", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--frames", type=click.IntRange(min=2 * EARLY), default=DRIVE_FRAMES, show_default=True)
def main(recording: Path | None, runs: int, frames: int) -> None:
    """Print the table."""
    click.echo(table(rows(recording, runs, frames)))


if __name__ == "__main__":
    main()
