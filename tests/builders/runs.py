"""Runs with known findings, for the tests of figures and page: no estimator is run."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fgbaseline.compare.estimate_comparison import Run, compare_all
from fgbaseline.data import Estimate, Landmarks, Problem, Sequence, Status, Truth
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.results.run import summarize

from .synthetic import Scene, plain_problem

FRAMES = 60


def scene(frames: int = FRAMES, **changes: Any) -> Sequence:
    """A curve of some tens of meters with its truth."""
    return replace(Scene(frames=frames).sequence(), **changes)


def answer(
    problem: Problem, name: str, drift: tuple[float, float, float] = (0.0, 0.0, 0.0), **changes: Any
) -> Estimate:
    """The true path with an error that grows to `drift`, m; true landmarks, every observation used."""
    truth = problem.sequence.truth or Scene(frames=problem.n_frames).sequence().truth
    assert truth is not None
    poses = truth.world_T_imu.copy()
    share = np.linspace(0.0, 1.0, len(poses))
    poses[:, :3, 3] += share[:, None] * np.asarray(drift)
    n = len(problem.sequence.observations)
    landmarks = Landmarks.none() if n == 0 or truth.landmarks is None else Landmarks(np.arange(12), truth.landmarks)
    estimate = Estimate(
        name=name,
        world_T_imu=poses,
        used=np.ones(n, dtype=np.bool_),
        covariance=np.tile(1e-2 * np.eye(6), (len(poses), 1, 1)),
        landmarks=landmarks,
        seconds=np.full(len(poses), 2e-3),
        seconds_total=0.002 * len(poses),
    )
    return replace(estimate, **changes)


def run_of(problem: Problem, *estimates: Estimate) -> Run:
    """The run in which these were the answers."""
    return compare_all(problem, {estimate.name: estimate for estimate in estimates}, {"seed": 0})


def standard_run(**changes: Any) -> Run:
    """Dead reckoning 6 m off at the end, the filter 3 m, the reference 0.3 m, with truth."""
    problem = plain_problem(scene(**changes))
    return run_of(
        problem,
        answer(problem, "dead-reckoning", (0.0, 6.0, 0.0), used=np.zeros(len(problem.excluded), dtype=np.bool_)),
        answer(problem, "ekf", (3.0, 0.0, 0.0)),
        answer(problem, "isam2", (0.0, 0.0, 0.3)),
    )


def failed(problem: Problem, name: str, reason: str) -> Estimate:
    """No answer."""
    return Estimate.failed(name, reason, problem.n_frames, len(problem.excluded))


def partly_known(truth: Truth, missing: int) -> Truth:
    """The truth without its last frames."""
    poses: FloatArray = truth.world_T_imu.copy()
    poses[len(poses) - missing :] = np.nan
    return replace(truth, world_T_imu=poses)


def as_dict(run: Run) -> Mapping[str, Any]:
    """`summary.json` of a run."""
    return summarize(run).model_dump(mode="json", by_alias=True)


RECOVERED = Status.RECOVERED
