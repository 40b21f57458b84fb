"""Fills the models of `summary.json` and `metrics.csv` from a run, with the reason for each value that is null."""

import math
import os
import platform
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.compare import CovarianceState, share_inside_bounds
from fgbaseline.compare.estimate_comparison import Evidence, Result, Run, frames_in_words, samples, share_of_time
from fgbaseline.data import Excluded, Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.figures.view import TopView
from fgbaseline.reports.results.run import EstimatorSummary, Summary
from fgbaseline.reports.results.tree import INFINITE, finite, nulls

REFERENCE = "it is the reference"


def evidence_summary(run: Run, result: Result) -> dict[str, Any]:
    """The parts of an estimator's summary that `evidence_schema` describes."""
    evidence = result.evidence
    moved = evidence.moved["moved"]
    return {
        "nees": None if evidence.nees is None else _nees(evidence.nees),
        "covariance": None if result.estimate.covariance is None else _covariance(evidence),
        "nees_reference": None if evidence.difference is None else _difference(evidence.difference),
        "sigma_ratio": None if evidence.sigma_ratio is None else _medians(evidence.sigma_ratio),
        "nis": asdict(evidence.nis) if evidence.nis.frames else None,
        "whitened": evidence.whitened,
        "moved_points": {
            "tracks": len(moved),
            "moved": int(moved.sum()),
            "share": float(moved.mean()) if len(moved) else math.nan,
        },
        "map": None if evidence.map is None else _map(evidence.map),
        "held_out": _held_out(run, result.name),
    }


def held_out_summary(run: Run) -> dict[str, Any] | None:
    """What was held out of the run."""
    report = run.held_out
    if report is None:
        return None
    held, errors = report.held, report.errors
    return {
        "share": held.share,
        "seed": held.seed,
        "tracks": held.n_tracks,
        "observations": len(held.observations),
        "pieces": 0 if errors is None else errors.pieces,
        "inliers": 0 if errors is None else errors.inliers,
        "gate_px": 0.0 if errors is None else errors.gate,
        "judged": 0 if errors is None else len(errors.table),
    }


def evidence_reasons(run: Run, result: Result) -> dict[str, str]:
    """Why a value of `evidence_summary` may be null, by key."""
    alone = REFERENCE if result.name == run.reference else "there is no reference"
    no_covariance = "it gives no covariance" if result.estimate.covariance is None else ""
    no_truth = "" if result.evidence.nees is not None else "the recording has no truth"
    no_tracks = "none of its landmarks has enough observations"
    is_alone = result.evidence.difference is None
    return {
        "nees": no_truth or no_covariance or "no frame has both a truth and a positive definite covariance",
        "covariance": "it gives no covariance",
        "nees_reference": alone
        if is_alone
        else no_covariance or "P - P_ref is positive definite in no frame, or one of the two has no covariance",
        "sigma_ratio": alone if is_alone else no_covariance or "no frame has two positive definite covariances",
        "nis": "it records no innovations",
        "whitened": no_tracks,
        "moved_points.share": no_tracks,
        "map": alone if is_alone else "it has no landmark in common with the reference",
        "map.median_sigmas": "no common landmark has covariances with P - P_ref positive definite",
        "held_out": "no tracks were held out" if run.held_out is None else "no held-out track is left to judge it by",
        "held_out.p95": "more than 5 % of the points lie behind the camera",
    }


def _nees(table: pd.DataFrame) -> dict[str, float | int]:
    values = _known(table["pose"].to_numpy())
    return {
        "mean": _or_nan(np.mean, values),
        "median": _or_nan(np.median, values),
        "position_mean": _or_nan(np.mean, _known(table["position"].to_numpy())),
        "rotation_mean": _or_nan(np.mean, _known(table["rotation"].to_numpy())),
        "inside_95": share_inside_bounds(values, 6.0),
        "frames": len(values),
    }


def _covariance(evidence: Evidence) -> dict[str, int | str]:
    state = evidence.covariance
    bad = np.flatnonzero(state == CovarianceState.NOT_POSITIVE_DEFINITE)
    return {
        "frames": int(np.sum(state != CovarianceState.ABSENT)),
        "held": int(np.sum(state == CovarianceState.HELD)),
        "not_positive_definite": len(bad),
        "where": frames_in_words(bad),
    }


def _difference(difference: compare.ReferenceNees) -> dict[str, float | int]:
    values = _known(difference.nees)
    return {
        "mean": _or_nan(np.mean, values),
        "median": _or_nan(np.median, values),
        "inside_95": share_inside_bounds(values, 6.0),
        "frames": len(values),
        "left_out": int(difference.left_out.sum()),
    }


def _medians(table: pd.DataFrame) -> dict[str, float]:
    return {str(name): float(value) for name, value in table.median().items()}


def _map(table: pd.DataFrame) -> dict[str, float | int]:
    medians = _medians(table[["distance", "seen", "sigmas"]])
    return {
        "n": len(table),
        "median": medians["distance"],
        "median_seen": medians["seen"],
        "median_sigmas": medians["sigmas"],
        "with_sigmas": int(table["sigmas"].notna().sum()),
        "left_out": int(table["left_out"].sum()),
    }


def _held_out(run: Run, name: str) -> dict[str, float | int] | None:
    if run.held_out is None or name not in run.held_out.ranking.index:
        return None
    ranking = run.held_out.ranking
    values = {str(column): float(ranking[column].to_dict()[name]) for column in ranking}
    return {"rank": list(ranking.index).index(name) + 1, **values}


def _known(values: FloatArray) -> FloatArray:
    return np.asarray(values[~np.isnan(values)])


def _or_nan(what: Any, values: FloatArray) -> float:
    return float(what(values)) if len(values) else math.nan


TOO_FEW = "it has too few frames in common with the other estimators to be ranked"
LIBRARIES = ("fgbaseline", "gtsam", "numpy", "pandas", "scipy", "matplotlib")


def summarise(run: Run) -> Summary:
    """The summary of a run; what is not a number is None, and its reason stands in `notes`."""
    sequence, problem = run.problem.sequence, run.problem
    return Summary.model_validate(
        finite(
            {
                "sequence": {
                    "name": sequence.name,
                    "source": sequence.source,
                    "form": sequence.form,
                    "frames": sequence.n_frames,
                    "duration_s": float(sequence.t[-1] - sequence.t[0]),
                    "observations": len(sequence.observations),
                    "tracks": sequence.n_landmarks,
                    "path_length_m": path_length(run),
                    "up": sequence.up.tolist(),
                    "ahead": TopView.of(problem).ahead.tolist(),
                    "remarks": list(sequence.remarks),
                },
                "problem": {
                    "preset": problem.preset,
                    "features": len(problem.features),
                    "diagnosed": problem.diagnosed,
                    "excluded": excluded_counts(problem),
                    "pixel_sigma": math.sqrt(problem.pixel_variance),
                    "remarks": list(problem.remarks),
                    "findings": [asdict(finding) for finding in problem.findings],
                    "repairs": list(problem.repairs),
                },
                "reference": {
                    "name": run.reference,
                    "trust": run.trust.verdict.name.lower(),
                    "reasons": list(run.trust.reasons),
                },
                "held_out": held_out_summary(run),
                "estimators": {name: _estimator(run, result) for name, result in run.results.items()},
                "settings": dict(run.settings),
                "versions": {"python": platform.python_version(), **{name: version(name) for name in LIBRARIES}},
                "machine": {"system": platform.system(), "processor": platform.machine(), "cores": os.cpu_count() or 0},
            }
        )
    )


def path_length(run: Run) -> float:
    """m: the length of the true path, else of the reference's, over the frames that have one."""
    truth = run.problem.sequence.truth
    if truth is not None:
        return _length(truth.world_T_imu)
    return math.nan if run.reference is None else _length(run.results[run.reference].estimate.world_T_imu)


def excluded_counts(problem: Problem) -> dict[str, int]:
    """Reason, in words -> how many observations of the sequence it keeps out of the problem."""
    counts = np.bincount(problem.excluded, minlength=len(Excluded))
    return {
        reason.name.lower().replace("_", " "): int(counts[reason])
        for reason in Excluded
        if reason is not Excluded.NO and counts[reason]
    }


def metrics_table(summary: Summary) -> pd.DataFrame:
    """`metrics.csv`: estimator, metric (its path in the summary) and value, one row for each number but the samples."""
    rows = [
        (name, metric, value) for name, estimator in summary.estimators.items() for metric, value in _numbers(estimator)
    ]
    return pd.DataFrame(rows, columns=["estimator", "metric", "value"])


def _numbers(estimator: EstimatorSummary) -> Iterator[tuple[str, float | int | None]]:
    def walk(prefix: str, value: Any) -> Iterator[tuple[str, float | int | None]]:
        if isinstance(value, Mapping):
            for key, inner in value.items():
                yield from walk(f"{prefix}.{key}" if prefix else str(key), inner)
        elif value is None or isinstance(value, int | float):
            yield prefix, value

    yield from walk("", estimator.model_dump(exclude={"notes", "status", "reason", "samples"}))


def _estimator(run: Run, result: Result) -> dict[str, Any]:
    estimate, table = result.estimate, result.reprojection
    common = np.zeros(len(run.problem.excluded), dtype=np.bool_) if run.common is None else run.common
    offered, used = int(run.problem.mask.sum()), int(estimate.used.sum())
    seconds = estimate.seconds_total
    values = {
        "status": str(estimate.status),
        "reason": estimate.reason,
        "seconds": seconds,
        "frames_per_second": run.problem.n_frames / seconds if seconds > 0 else math.nan,
        "reprojection": compare.reprojection_summary(table),
        "reprojection_used": compare.reprojection_summary(table[table["used"]]),
        "reprojection_common": compare.reprojection_summary(table[common[table["observation"]]]),
        "components": compare.component_summary(table),
        "divergence": None if result.divergence is None else compare.divergence_summary(result.divergence),
        "coverage": share_of_time(run.problem.sequence.t, np.isfinite(estimate.world_T_imu[:, 0, 0])),
        "divergence_common": None if result.divergence_common is None else asdict(result.divergence_common),
        "ate_common": None if result.ate_common is None else asdict(result.ate_common),
        "ate": None if result.truth_aligned is None else compare.summarized(result.truth_aligned["position"]),
        "ate_unaligned": None if result.truth is None else compare.divergence_summary(result.truth),
        "truth": None if result.truth is None else _truth_count(result.truth),
        **evidence_summary(run, result),
        "landmarks": len(estimate.landmarks),
        "observations": {"offered": offered, "used": used, "share": used / offered if offered else math.nan},
        "samples": samples(run, result) if result.answered else {},
        "events": dict(sorted(Counter(event.kind for event in estimate.events).items())),
    }
    return {**values, "notes": notes(run, result, nulls(values))}


def notes(run: Run, result: Result, absent: Iterable[tuple[str, bool]]) -> dict[str, str]:
    """Why values are null, by key: for all that lies below it, `*` for all. `absent` are their paths, and whether a
    value is infinite."""
    estimate = result.estimate
    if not result.answered:
        return {"*": f"the estimator failed: {estimate.reason}"}
    reached = bool(np.isfinite(estimate.world_T_imu[-1]).all())
    last = "the last frame has no truth" if reached else "it did not reach the last frame"
    no_truth = result.truth is None
    reasons = {
        "reprojection": None if len(estimate.landmarks) else "it estimated no landmarks",
        "reprojection_used": None if estimate.used.any() else "it uses no observations",
        "reprojection_common": "it has none of the observations that every estimator used",
        "components": None if len(estimate.landmarks) else "it estimated no landmarks",
        "divergence": "there is no reference to diverge from" if result.divergence is None else None,
        "divergence.final": "it or the reference did not reach the last frame",
        "divergence.rotation_final_deg": "it or the reference did not reach the last frame",
        "ate": "the recording has no truth" if no_truth else "no frame has both a pose and a truth",
        "ate_common": "the recording has no truth" if no_truth else TOO_FEW,
        "divergence_common": "there is no reference to diverge from" if result.divergence is None else TOO_FEW,
        "ate_unaligned": "the recording has no truth" if no_truth else None,
        "ate_unaligned.final": last,
        "ate_unaligned.rotation_final_deg": last,
        "truth": "the recording has no truth",
        **evidence_reasons(run, result),
        "frames_per_second": "it took no measurable time",
        "observations.share": "the problem has no observations",
    }
    told: dict[str, str] = {}
    for null, infinite in absent:
        if infinite:
            told[null] = INFINITE
            continue
        key = next((k for k in (null, null.partition(".")[0]) if reasons.get(k)), null)
        told[key] = reasons.get(key) or "it is not a finite number"
    return told


def _truth_count(table: pd.DataFrame) -> dict[str, int]:
    frames = int(table["position"].notna().sum())
    return {"frames": frames, "missing": len(table) - frames}


def _length(poses: FloatArray) -> float:
    positions = poses[np.isfinite(poses).all(axis=(1, 2)), :3, 3]
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
