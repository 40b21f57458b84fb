"""A run: the answers of all estimators, and every comparison that tables, figures and the page draw on."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from fgbaseline import compare
from fgbaseline.data import Estimate, HeldOut, Problem, Status
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.parallel import shared
from fgbaseline.geometry import FloatArray

from .common_frames import CommonRmse, common_rmse
from .evidence import Evidence, HeldOutReport, gathered, held_out_report

REFERENCES = ("isam2", "batch", "fixed-lag", "joint-ekf", "ekf", "dead-reckoning")
"""the reference of a run is the first of these that gave an answer"""
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
    evidence: Evidence
    divergence_common: CommonRmse | None = None
    """what ranks it: over the frames that all estimators have; None where it is not ranked"""
    ate_common: CommonRmse | None = None
    """the same of `truth_aligned`"""

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
    held_out: HeldOutReport | None = None
    """None where no tracks were held out"""

    @property
    def answered(self) -> list[Result]:
        """The results that have a trajectory."""
        return [result for result in self.results.values() if result.answered]


def compare_all(
    problem: Problem,
    estimates: Mapping[str, Estimate],
    settings: Mapping[str, object],
    held: HeldOut | None = None,
    processes: int = 1,
) -> Run:
    """All comparisons of a run, `held` being the tracks that were kept from it; so many `processes` share the work."""
    reference = next((n for n in REFERENCES if n in estimates and estimates[n].status is not Status.FAILED), None)
    if reference is None:
        trusted = compare.Trust(compare.Verdict.UNTRUSTED, (NO_REFERENCE,))
    else:
        trusted = compare.trust(problem, estimates[reference], estimates.get("batch"))
    origin = None if reference is None else estimates[reference]
    names = list(estimates)
    with shared(lambda i: _compared(problem, estimates[names[i]], origin), len(names), processes) as compared:
        parts = compared()
    results = {name: Result(estimates[name], **part) for name, part in zip(names, parts, strict=True)}
    divergences = {n: r.divergence for n, r in results.items() if r.answered and r.divergence is not None}
    truths = {n: r.truth_aligned for n, r in results.items() if r.answered and r.truth_aligned is not None}
    from_reference, to_truth = common_rmse(divergences), common_rmse(truths)
    results = {
        name: replace(result, divergence_common=from_reference.get(name), ate_common=to_truth.get(name))
        for name, result in results.items()
    }
    held_out = None if held is None else held_out_report(problem, estimates.values(), held)
    return Run(problem, results, reference, trusted, compare.used_by_all(estimates.values()), settings, held_out)


def _compared(problem: Problem, estimate: Estimate, reference: Estimate | None) -> dict[str, Any]:
    """All of a `Result` but the estimate itself, which need not be sent from one process to another."""
    truth, up = problem.sequence.truth, problem.sequence.up
    reprojection = compare.reprojection(problem.sequence, estimate)
    evidence = gathered(problem, estimate, reprojection, reference)
    return {
        "reprojection": reprojection,
        "divergence": None if reference is None else compare.divergence(estimate, reference, up),
        "truth": None if truth is None else compare.truth_errors(estimate, truth, up),
        "truth_aligned": None if truth is None else compare.truth_errors(estimate, truth, up, aligned=True),
        "nees": None if evidence.nees is None else evidence.nees["pose"].to_numpy(),
        "evidence": evidence,
    }
