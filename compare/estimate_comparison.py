"""All estimates of one problem compared: with the reference, with ground truth and with each other."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from fgbaseline import compare
from fgbaseline.data import Estimate, HeldOut, Problem, Status
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.parallel import shared
from fgbaseline.geometry import FloatArray


@dataclass(frozen=True, slots=True)
class CommonRmse:
    """The RMSE of positions over the frames that all estimators have which take part."""

    rmse: float
    """m"""
    frames: int


def known(table: pd.DataFrame) -> BoolArray:
    """(T,) the frames for which a table of `compare.pose_errors` has a position."""
    return np.asarray(table["position"].notna(), dtype=np.bool_)


def common_rmse(tables: Mapping[str, pd.DataFrame]) -> dict[str, CommonRmse]:
    """By name the RMSE over the frames that all tables of `compare.pose_errors` have; empty without such a frame.

    An estimator with far fewer frames than the others takes no part: see `compare.rankable`.
    """
    there = {name: known(table) for name, table in tables.items()}
    names = compare.rankable({name: int(frames.sum()) for name, frames in there.items()})
    if not names:
        return {}
    common = np.logical_and.reduce([there[name] for name in names])
    n = int(common.sum())
    errors = {name: tables[name]["position"].to_numpy(dtype=np.float64)[common] for name in names}
    return {name: CommonRmse(compare.summarized(errors[name])["rmse"], n) for name in names} if n else {}


def same_frames(frames: Iterable[BoolArray]) -> bool:
    """Whether all of them are the same (T,)."""
    every = list(frames)
    return all(np.array_equal(every[0], other) for other in every[1:])


def share_of_time(t: FloatArray, frames: BoolArray) -> float:
    """The share of the recording's time in which there are these frames (T,): see `compare.time_coverage`."""
    return compare.time_coverage(t[frames], t)


@dataclass(frozen=True, eq=False, slots=True)
class Evidence:
    """One estimator's."""

    covariance: NDArray[np.uint8]
    """(T,) a `compare.CovarianceState` each"""
    error: FloatArray | None
    """(T, 6) in the body frame: see `compare.body_error`; None without truth"""
    nees: pd.DataFrame | None
    """see `compare.nees_table`; None without truth"""
    difference: compare.ReferenceNees | None
    """against the reference; None for the reference itself, and without one"""
    sigma_ratio: pd.DataFrame | None
    """its sigmas over those of the reference, by frame; None likewise"""
    nis_per_degree: FloatArray
    """(T,) NaN where it recorded no innovation"""
    nis: compare.NisSummary
    whitened: dict[str, float | int]
    """see `compare.whitened_summary`"""
    patterns: pd.DataFrame
    """see `compare.residual_patterns`"""
    moved: pd.DataFrame
    """see `compare.dynamic_landmarks`"""
    map: pd.DataFrame | None
    """see `compare.map_difference`; None for the reference itself, and without one"""


@dataclass(frozen=True, eq=False, slots=True)
class HeldOutReport:
    """The tracks that were kept from the run, and what the paths make of them."""

    held: HeldOut
    errors: compare.HeldOutErrors | None
    """None where no estimator answered"""
    ranking: pd.DataFrame
    """see `compare.held_out_ranking`; empty where no track is left to judge by"""


def gathered(problem: Problem, estimate: Estimate, reprojection: pd.DataFrame, reference: Estimate | None) -> Evidence:
    """The evidence on an estimate, `reprojection` being its table."""
    truth = problem.sequence.truth
    other = None if reference is None or reference.name == estimate.name else reference
    return Evidence(
        covariance=compare.covariance_state(estimate),
        error=None if truth is None else compare.body_error(estimate, truth),
        nees=None if truth is None else compare.nees_table(estimate, truth),
        difference=None if other is None else compare.reference_nees(estimate, other),
        sigma_ratio=None if other is None else compare.sigma_ratio(estimate, other),
        nis_per_degree=compare.nis_per_degree(estimate),
        nis=compare.nis_summary(estimate),
        whitened=compare.whitened_summary(problem, reprojection),
        patterns=compare.residual_patterns(problem.sequence, reprojection),
        moved=compare.dynamic_landmarks(problem, estimate, reprojection),
        map=None if other is None else compare.map_difference(problem.sequence, estimate, other),
    )


def held_out_report(problem: Problem, estimates: Iterable[Estimate], held: HeldOut) -> HeldOutReport:
    """The ranking of all estimates that answered."""
    paths = {e.name: e.world_T_imu for e in estimates if e.status is not Status.FAILED}
    if not paths:
        return HeldOutReport(held, None, pd.DataFrame())
    errors = compare.held_out_errors(problem.sequence, held, paths, problem.pixel_variance)
    return HeldOutReport(held, errors, compare.held_out_ranking(errors))


def frames_in_words(frames: NDArray[np.int64]) -> str:
    """`3, 7 to 9` for rising frames; empty for none."""
    if len(frames) == 0:
        return ""
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs)


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


def samples(run: Run, result: Result) -> dict[str, dict[str, float]]:
    """By the beginning of a metric's path: `n` of what it is taken over, and the `coverage` of the recording's time.

    n are frames, of the reprojection observations, of the map landmarks, else tracks; what is not spread over time has
    no coverage.
    """
    t, evidence = run.problem.sequence.t, result.evidence
    found: dict[str, dict[str, float]] = {}

    def of_frames(frames: BoolArray, *keys: str) -> None:
        sample = {"n": int(frames.sum()), "coverage": compare.time_coverage(t[frames], t)}
        found.update(dict.fromkeys(keys, sample))

    if result.divergence is not None:
        of_frames(known(result.divergence), "divergence")
    if result.truth is not None:
        of_frames(known(result.truth), "ate", "ate_unaligned")
    for key, common in (("divergence_common", result.divergence_common), ("ate_common", result.ate_common)):
        if common is not None:
            found[key] = {"n": common.frames}
    by_frame = {
        "nees": None if evidence.nees is None else evidence.nees["pose"].to_numpy(),
        "nees_reference": None if evidence.difference is None else evidence.difference.nees,
        "sigma_ratio": None if evidence.sigma_ratio is None else evidence.sigma_ratio["position"].to_numpy(),
        "nis": evidence.nis_per_degree,
    }
    for key, values in by_frame.items():
        if values is not None:
            of_frames(np.asarray(np.isfinite(values), dtype=np.bool_), key)
    return {**found, **_of_observations(run, result), **_without_time(run, result)}


def _of_observations(run: Run, result: Result) -> dict[str, dict[str, float]]:
    """Observations, and the time of the frames that they are in."""
    t, table = run.problem.sequence.t, result.reprojection
    common = np.zeros(len(run.problem.excluded), dtype=np.bool_) if run.common is None else run.common
    parts = {
        "reprojection": table,
        "components": table,
        "reprojection_used": table[table["used"]],
        "reprojection_common": table[common[table["observation"]]],
    }
    return {
        key: {"n": len(part), "coverage": compare.time_coverage(t[np.unique(part["frame"])], t)}
        for key, part in parts.items()
    }


def _without_time(run: Run, result: Result) -> dict[str, dict[str, float]]:
    evidence = result.evidence
    counts = {"whitened": int(evidence.whitened["tracks"]), "moved_points": len(evidence.moved)}
    if evidence.map is not None:
        counts |= {"map": len(evidence.map), "map.median_sigmas": int(evidence.map["sigmas"].notna().sum())}
    if run.held_out is not None and result.name in run.held_out.ranking.index:
        counts["held_out"] = int(run.held_out.ranking.attrs["n"])
    return {key: {"n": n} for key, n in counts.items()}


def of_truth(run: Run) -> Mapping[str, float] | None:
    """The sample that errors to the truth rest on at best: the frames that have one; None without truth."""
    truth, t = run.problem.sequence.truth, run.problem.sequence.t
    return (
        None if truth is None else {"n": int(truth.known.sum()), "coverage": compare.time_coverage(t[truth.known], t)}
    )


def map_by_depth(result: Result) -> pd.DataFrame | None:
    """See `compare.map_by_depth`; None for the reference and where no landmark is shared."""
    table = result.evidence.map
    return None if table is None or len(table) == 0 else compare.map_by_depth(table).reset_index()
