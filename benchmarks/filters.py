"""Speed of the filters, as ratios: `python -m benchmarks.filters 03.npz --runs 5`.

The seconds are CPU time of this process with BLAS held to one thread, and every ratio is of two measurements that
follow each other: other work on the machine slows both. The literal filter of tests/builders/dense_filter.py, which
inverts what the equations print inverted and multiplies matrices of 3M x 3M, would take an hour for a recording of a
hundred seconds: each run times it on frames at random, on all that a frame asks for, and scales by the number of
frames. What a frame costs it depends on how many observations there are, not on what they say.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import click
import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.claim_table import Row, row, table
from fgbaseline import data, diagnosis, ekf
from fgbaseline.data import Problem, Sequence
from tests.builders.dense_filter import DenseFilter

FEATURES = 1000
"""features of the documented filter where it is compared with the literal one"""
DENSE_FRAMES = 2
"""on which each run times the literal filter"""


def cpu_seconds(work: Callable[[], object]) -> float:
    """CPU time of this process for one go."""
    start = time.process_time()
    work()
    return time.process_time() - start


def chain(problem: Problem) -> None:
    """The report's parts a, b and c."""
    ekf.dead_reckoning(problem)
    ekf.landmark_mapping(problem)
    ekf.ekf(problem)


class LiteralFrames:
    """The literal filter at single frames."""

    def __init__(self, problem: Problem) -> None:
        self.dense = DenseFilter(problem)
        self.path, _ = self.dense.dead_reckoning()
        self.mean = self.dense.prior_mean
        self.covariance = np.kron(np.eye(self.dense.M), self.dense.prior_variance).astype(np.float64)

    def mapping(self, k: int) -> None:
        """Equations 11 and 12 at frame k."""
        self.dense.update_landmarks(k, self.path[k], self.mean, self.covariance, self.dense.V_mapping)

    def chain(self, k: int) -> None:
        """All that frame k asks for in parts a, b and c: 9; 9, 11 and 12; 9, 13, 11 and 12."""
        sigma = self.dense.problem.increment_covariance[k - 1]
        for _ in range(2):
            self.dense.predict(k - 1, self.path[k - 1], sigma)
        self.mapping(k)
        self.dense.update_pose(k, self.path[k], sigma, self.mean)
        self.dense.update_landmarks(k, self.path[k], self.mean, self.covariance, self.dense.V_slam)


def rows(recording: Path, runs: int) -> list[Row]:
    """The claims on the filters' speed, measured on a recording, `runs` times each."""
    sequence = data.read(recording)
    with threadpool_limits(limits=1):
        return [*documented(sequence, runs), *joint(sequence, runs)]


def documented(sequence: Sequence, runs: int) -> list[Row]:
    """The documented filter, against the literal one and against itself with all features."""
    some, everything = data.documented(sequence, FEATURES), data.documented(sequence, None)
    literal = LiteralFrames(some)
    random = np.random.default_rng(0)
    whole: list[float] = []
    mapping: list[float] = []
    more: list[float] = []
    chain(some)  # the first go pays for imports
    for _ in range(runs):
        frames = random.choice(np.arange(1, some.n_frames), DENSE_FRAMES, replace=False)
        scale = some.n_frames / DENSE_FRAMES
        ours = cpu_seconds(lambda: chain(some))
        whole.append(scale * sum(cpu_seconds(partial(literal.chain, int(k))) for k in frames) / ours)
        ours = cpu_seconds(lambda: ekf.landmark_mapping(some))
        mapping.append(scale * sum(cpu_seconds(partial(literal.mapping, int(k))) for k in frames) / ours)
        more.append(cpu_seconds(lambda: chain(everything)) / cpu_seconds(lambda: chain(some)))
    n = len(some.features)
    times = len(everything.observations()) / len(some.observations())
    return [
        row(
            f"documented filter, parts a to c, {n} features: the literal one (scaled from {DENSE_FRAMES} frames) takes",
            whole,
            " times",
            least=10.0,
        ),
        row(
            f"mapping, {n} features: a dense 3M x 3M one as printed (scaled likewise) takes",
            mapping,
            " times",
            least=50.0,
        ),
        row(
            f"documented filter with all {len(everything.features)} features ({times:.2f} times the observations), "
            f"to {n} features",
            more,
            " times",
            most=2.5,
        ),
    ]


def joint(sequence: Sequence, runs: int) -> list[Row]:
    """The joint filter, against the time that the recording took."""
    problem = diagnosis.calibrated(sequence)
    duration = float(sequence.t[-1] - sequence.t[0])
    seconds = [cpu_seconds(lambda: ekf.joint_ekf(problem)) for _ in range(runs)]
    return [
        row(
            f"joint-ekf, all {len(problem.features)} features, {duration:.0f} s of driving: real time",
            [duration / each for each in seconds],
            " times",
            least=40.0,
        ),
        row("joint-ekf: CPU seconds", seconds, " s", most=duration / 40.0),
    ]


@click.command()
@click.argument("recording", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--runs", type=click.IntRange(min=1), default=5, show_default=True)
def main(recording: Path, runs: int) -> None:
    """Measure the claims on RECORDING."""
    click.echo(f"{recording.name}, {runs} runs, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n")
    click.echo(table(rows(recording, runs)))


if __name__ == "__main__":
    main()
