"""Run and comparison of its estimators with reference and truth: trajectories, consistency, residuals, map, tracks."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from fgbaseline import compare
from fgbaseline.data import Estimate, HeldOut, Problem, Status, Truth
from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.parallel import background_map
from fgbaseline.geometry import FloatArray

REFERENCES = ("isam2", "batch", "fixed-lag", "joint-ekf", "ekf", "dead-reckoning")
"""the reference of a run is the first of these that succeeded"""
SAME_GRAPH = ("isam2", "batch")
"""estimators with the same cost function: their divergence compares solvers"""
NO_REFERENCE = "no estimator succeeded, so there is nothing to compare with"


@dataclass(frozen=True, slots=True)
class CommonRmse:
    """RMSE of positions over the frames that all ranked estimators have."""

    rmse: float
    """m"""
    frames: int


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Evidence(Displayed):
    """Consistency, residuals and map of an estimate.

    `error` and `nees` are None without truth; `difference`, `sigma_ratio` and `map` without a reference, and for the
    reference itself.
    """

    covariance: NDArray[np.uint8]
    """(T,) `compare.CovarianceState` of each frame"""
    error: FloatArray | None
    """(T, 6) in the body frame: see `compare.body_error`"""
    nees: pd.DataFrame | None
    """see `compare.nees_table`"""
    difference: compare.ReferenceNees | None
    """NEES of the difference from the reference"""
    sigma: compare.PoseSigma
    """1-sigma of the poses by the covariances of the estimate; NaN without"""
    sigma_ratio: pd.DataFrame | None
    """sigmas over those of the reference: see `compare.sigma_ratio`"""
    nis_per_degree: FloatArray
    """(T,) NaN where no innovation is recorded"""
    nis: compare.NisSummary
    whitened: dict[str, float | int]
    """see `compare.whitened_summary`"""
    patterns: pd.DataFrame
    """see `compare.residual_patterns`"""
    moved: pd.DataFrame
    """see `compare.dynamic_landmarks`"""
    map: pd.DataFrame | None
    """see `compare.map_difference`"""

    @property
    def map_by_depth(self) -> pd.DataFrame | None:
        """See `compare.map_by_depth`; None for the reference and where the maps share no landmark."""
        return None if self.map is None or len(self.map) == 0 else compare.map_by_depth(self.map).reset_index()


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class InertialEvidence(Displayed):
    """Velocity and biases of an estimate from raw inertial data. Comparisons are None without truth or reference.

    For the columns see `compare.velocity_and_bias_errors`.
    """

    values: pd.DataFrame
    """see `compare.velocity_and_biases`"""
    errors: pd.DataFrame | None
    """errors from the truth without alignment, in the world of the sigmas"""
    aligned: pd.DataFrame | None
    """errors from the truth after the alignment of `Result.truth_aligned`"""
    divergence: pd.DataFrame | None
    """differences from the reference; None for the reference itself"""
    nees: pd.DataFrame | None
    """NEES of the 15 and of each block: see `compare.state_nees`"""

    @property
    def series(self) -> pd.DataFrame:
        """Table of all parts by frame: `velocity_x`, `truth_velocity_x` (unaligned), `divergence_velocity_x`, ...

        Sigmas are given once, with the values. `nees_state` is the NEES of all 15 components.
        """
        parts = [self.values]
        for prefix, errors in (("truth", self.errors), ("divergence", self.divergence)):
            if errors is not None:
                parts.append(errors[[c for c in errors if "_sigma_" not in str(c)]].add_prefix(f"{prefix}_"))
        if self.nees is not None:
            parts.append(self.nees.add_prefix("nees_state_").rename(columns={"nees_state_state": "nees_state"}))
        return pd.concat(parts, axis=1)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class HeldOutReport(Displayed):
    """Tracks that were held out of the run, and the prediction errors of the paths on them."""

    held: HeldOut
    errors: compare.HeldOutErrors | None
    """None where no estimator succeeded"""
    ranking: pd.DataFrame
    """see `compare.held_out_ranking`; empty where no held-out track can be used"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Result(Displayed):
    """Estimate of a run with its comparison to reference and truth."""

    estimate: Estimate
    reprojection: pd.DataFrame
    """one row per observation of the estimated landmarks: see `compare.reprojection`"""
    divergence: pd.DataFrame | None
    """differences from the reference, one row per frame: see `compare.pose_errors`; None without a reference"""
    truth: pd.DataFrame | None
    """errors from the truth without alignment; None without truth"""
    truth_aligned: pd.DataFrame | None
    """errors from the truth after alignment in yaw and position with raw inertial data, otherwise in SE(3)"""
    evidence: Evidence
    inertial: InertialEvidence | None = None
    """None for an estimate without velocity and biases"""
    divergence_common: CommonRmse | None = None
    """divergence over the frames that all estimators have, for ranking; None if the estimator is not ranked"""
    ate_common: CommonRmse | None = None
    """RMSE of `truth_aligned` over the common frames"""

    @property
    def name(self) -> str:
        """Name under which the estimator is registered."""
        return self.estimate.name

    @property
    def answered(self) -> bool:
        """Whether there is a trajectory to show."""
        return self.estimate.status is not Status.FAILED

    @property
    def nees(self) -> FloatArray | None:
        """NEES (T,) of the poses against truth; None without truth."""
        return None if self.evidence.nees is None else self.evidence.nees["pose"].to_numpy()

    @property
    def divergence_rmse(self) -> float:
        """RMSE of the positions against the reference, m; NaN without a reference."""
        return float("nan") if self.divergence is None else compare.divergence_summary(self.divergence)["rmse"]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Run(Displayed):
    """Problem, results of all estimators and the reference among them."""

    problem: Problem
    results: Mapping[str, Result]
    """results by name of the estimator, in the order of the request"""
    reference: str | None
    trust: compare.Trust
    common: BoolArray | None
    """(n,) mask of the observations used by all estimators that use any"""
    settings: Mapping[str, object]
    """settings of the user, for the record"""
    held_out: HeldOutReport | None = None
    """None where no tracks were held out"""
    added: Mapping[str, str] = field(default_factory=dict)
    """name -> pairing and alignment of each trajectory from a file; they are among the results"""

    @property
    def answered(self) -> list[Result]:
        """Results that have a trajectory."""
        return [result for result in self.results.values() if result.answered]

    @property
    def compared(self) -> list[Result]:
        """Results that are compared with the reference, sorted by RMSE of the divergence."""
        others = [r for r in self.answered if r.name != self.reference and r.divergence is not None]
        return sorted(others, key=lambda result: result.divergence_rmse)

    @property
    def by_products(self) -> frozenset[str]:
        """Estimators whose estimates are by-products of the reference's run."""
        return frozenset() if self.reference is None else frozenset(self.results[self.reference].estimate.by_products)

    @property
    def same_graph(self) -> frozenset[str]:
        """Other estimators that minimize the cost of the reference."""
        return frozenset(SAME_GRAPH) - {self.reference} if self.reference in SAME_GRAPH else frozenset()

    @property
    def unranked(self) -> frozenset[str]:
        """Estimators that are not ranked: by-products, the same graph, trajectories from files."""
        return self.by_products | self.same_graph | self.added.keys()


def reference_among(estimates: Mapping[str, Estimate]) -> str | None:
    """Name of the reference, the first of `REFERENCES` that succeeded; None if all failed."""
    return next((n for n in REFERENCES if n in estimates and estimates[n].status is not Status.FAILED), None)


def compare_all(
    problem: Problem,
    estimates: Mapping[str, Estimate],
    settings: Mapping[str, object],
    held: HeldOut | None = None,
    processes: int = 1,
    added: Mapping[str, str] | None = None,
) -> Run:
    """Compares all estimates of a run with reference and truth, in `processes` processes.

    `held` are the tracks held out of the run. `added` are names and captions of estimates from files, which are
    aligned to the reference and therefore not ranked.
    """
    added = added or {}
    reference = reference_among(estimates)
    if reference is None:
        trusted = compare.Trust(compare.Verdict.UNTRUSTED, (NO_REFERENCE,))
    else:
        trusted = compare.trust(problem, estimates[reference], estimates.get("batch"))
    origin = None if reference is None else estimates[reference]
    names = list(estimates)
    with background_map(lambda i: _compared(problem, estimates[names[i]], origin), len(names), processes) as compared:
        parts = compared()
    results = {name: Result(estimates[name], **part) for name, part in zip(names, parts, strict=True)}
    ranked = {name: r for name, r in results.items() if name not in added and r.answered}
    from_reference = common_rmse({name: r.divergence for name, r in ranked.items() if r.divergence is not None})
    to_truth = common_rmse({name: r.truth_aligned for name, r in ranked.items() if r.truth_aligned is not None})
    results = {
        name: replace(result, divergence_common=from_reference.get(name), ate_common=to_truth.get(name))
        for name, result in results.items()
    }
    held_out = None if held is None else _held_out_report(problem, estimates.values(), held)
    common = compare.used_by_all(estimates.values())
    return Run(problem, results, reference, trusted, common, settings, held_out, added)


def _compared(problem: Problem, estimate: Estimate, reference: Estimate | None) -> dict[str, Any]:
    """Fields of a `Result` except the estimate, which would cost time to send between processes."""
    sequence, truth = problem.sequence, problem.sequence.truth
    other = None if reference is None or reference.name == estimate.name else reference
    alignment = True if problem.imu is None else compare.Align.YAW
    reprojection = compare.reprojection(sequence, estimate)
    evidence = Evidence(
        covariance=compare.covariance_state(estimate),
        error=None if truth is None else compare.body_error(estimate, truth),
        nees=None if truth is None else compare.nees_table(estimate, truth),
        difference=None if other is None else compare.reference_nees(estimate, other),
        sigma=compare.pose_sigma(estimate),
        sigma_ratio=None if other is None else compare.sigma_ratio(estimate, other),
        nis_per_degree=compare.nis_per_degree(estimate),
        nis=compare.nis_summary(estimate),
        whitened=compare.whitened_summary(problem, reprojection),
        patterns=compare.residual_patterns(sequence, reprojection),
        moved=compare.dynamic_landmarks(problem, estimate, reprojection),
        map=None if other is None else compare.map_difference(sequence, estimate, other),
    )
    aligned = None if truth is None else compare.truth_errors(estimate, truth, sequence.up, aligned=alignment)
    return {
        "reprojection": reprojection,
        "divergence": None if reference is None else compare.divergence(estimate, reference, sequence.up),
        "truth": None if truth is None else compare.truth_errors(estimate, truth, sequence.up),
        "truth_aligned": aligned,
        "evidence": evidence,
        "inertial": None if estimate.velocity is None else _inertial_evidence(estimate, truth, other, sequence.up),
    }


def _inertial_evidence(
    estimate: Estimate, truth: Truth | None, reference: Estimate | None, up: FloatArray
) -> InertialEvidence:
    values = compare.velocity_and_biases(estimate)
    divergence = None if reference is None else compare.velocity_and_bias_errors(estimate, reference)
    if truth is None:
        return InertialEvidence(values, None, None, divergence, None)
    rotation = compare.truth_alignment(estimate, truth, compare.Align.YAW, up).rotation
    return InertialEvidence(
        values,
        compare.velocity_and_bias_errors(estimate, truth),
        compare.velocity_and_bias_errors(estimate, truth, rotation),
        divergence,
        compare.state_nees(estimate, truth),
    )


def _held_out_report(problem: Problem, estimates: Iterable[Estimate], held: HeldOut) -> HeldOutReport:
    paths = {e.name: e.world_T_imu for e in estimates if e.status is not Status.FAILED}
    if not paths:
        return HeldOutReport(held, None, pd.DataFrame())
    errors = compare.held_out_errors(problem.sequence, held, paths, problem.pixel_variance)
    return HeldOutReport(held, errors, compare.held_out_ranking(errors))


def known(table: pd.DataFrame) -> BoolArray:
    """Mask (T,) of the frames for which a table of `compare.pose_errors` has a position."""
    return np.asarray(table["position"].notna(), dtype=np.bool_)


def common_rmse(tables: Mapping[str, pd.DataFrame]) -> dict[str, CommonRmse]:
    """RMSE by name over the frames that all tables of `compare.pose_errors` have; empty without such a frame.

    An estimator with far fewer frames than the others is left out: see `compare.rankable`.
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
    """Whether all masks (T,) are equal."""
    every = list(frames)
    return all(np.array_equal(every[0], other) for other in every[1:])
