"""A run: every estimator on one problem, and all comparisons that tables, figures and the page draw on."""

import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.data import Estimate, Problem, Progress, Status, find_estimator
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FgbaselineError, FloatArray

REFERENCES = ("isam2", "batch", "fixed-lag", "joint-ekf", "ekf", "dead-reckoning")
"""the reference of a run is the first of these that gave an answer"""
Watch: TypeAlias = Callable[[str], AbstractContextManager[Progress | None]]
"""around the work of a named estimator: gives what is told of every frame"""
NO_REFERENCE = "no estimator gave an answer to compare with"


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """One estimator of a run, compared."""

    estimate: Estimate
    reprojection: pd.DataFrame
    """one row per observation of its landmarks: see `compare.reprojection`"""
    divergence: pd.DataFrame | None
    """from the reference, one row per frame: see `compare.pose_errors`; None without a reference"""
    truth: pd.DataFrame | None
    """from the truth as it is; None without truth"""
    truth_aligned: pd.DataFrame | None
    """from the truth after SE(3) alignment"""
    nees: FloatArray | None
    """(T,) against truth"""

    @property
    def name(self) -> str:
        """The name the estimator is registered under."""
        return self.estimate.name

    @property
    def answered(self) -> bool:
        """Whether there is a trajectory to show."""
        return self.estimate.status is not Status.FAILED


@dataclass(frozen=True, eq=False, slots=True)
class Run:
    """All there is to report."""

    problem: Problem
    results: Mapping[str, Result]
    """by estimator name, in the order asked for"""
    reference: str | None
    trust: compare.Trust
    common: BoolArray | None
    """(n,) the observations that every estimator used which uses any"""
    settings: Mapping[str, object]
    """what the user asked for, for the record"""

    @property
    def answered(self) -> list[Result]:
        """The results that have a trajectory."""
        return [result for result in self.results.values() if result.answered]


def unwatched(name: str) -> AbstractContextManager[Progress | None]:  # noqa: ARG001
    """Nobody is told of progress."""
    return nullcontext(None)


def solve_all(problem: Problem, names: Iterable[str], watch: Watch = unwatched) -> dict[str, Estimate]:
    """Each named estimator's answer, in the order of the names; a failure is an answer and stops nothing.

    What one run gives along with another (`isam2-online` with `isam2`) is not solved again.
    """
    answers: dict[str, Estimate] = {}
    given: dict[str, Estimate] = {}
    for name in names:
        solve = find_estimator(name)
        if name in given:
            answers[name] = given[name]
            continue
        start = time.perf_counter()
        try:
            with watch(name) as progress:
                estimate = solve(problem, progress)
        except (FgbaselineError, ArithmeticError, np.linalg.LinAlgError, RuntimeError, ValueError, IndexError) as error:
            reason = (
                f"{type(error).__name__}: {str(error).strip().splitlines()[0] if str(error).strip() else 'no text'}"
            )
            estimate = Estimate.failed(name, reason, problem.n_frames, len(problem.excluded))
            estimate = replace(estimate, seconds_total=time.perf_counter() - start)
        answers[name] = estimate
        given |= estimate.by_products
    return answers


def compare_all(problem: Problem, estimates: Mapping[str, Estimate], settings: Mapping[str, object]) -> Run:
    """All comparisons of a run."""
    reference = next((n for n in REFERENCES if n in estimates and estimates[n].status is not Status.FAILED), None)
    if reference is None:
        trusted = compare.Trust(compare.Verdict.UNTRUSTED, (NO_REFERENCE,))
    else:
        trusted = compare.trust(problem, estimates[reference])
    origin = None if reference is None else estimates[reference]
    results = {name: _compared(problem, estimate, origin) for name, estimate in estimates.items()}
    return Run(problem, results, reference, trusted, compare.commonly_used(estimates.values()), settings)


def _compared(problem: Problem, estimate: Estimate, reference: Estimate | None) -> Result:
    truth, up = problem.sequence.truth, problem.sequence.up
    return Result(
        estimate=estimate,
        reprojection=compare.reprojection(problem.sequence, estimate),
        divergence=None if reference is None else compare.divergence(estimate, reference, up),
        truth=None if truth is None else compare.truth_errors(estimate, truth, up),
        truth_aligned=None if truth is None else compare.truth_errors(estimate, truth, up, aligned=True),
        nees=None if truth is None else compare.nees(estimate, truth),
    )
