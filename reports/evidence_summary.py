"""The evidence of a run as `summary.json` has it, and the reasons where there is none."""

import math
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.compare import CovarianceState, share_inside_bounds
from fgbaseline.geometry import FloatArray

from .comparison import Result, Run
from .evidence import Evidence, frames_in_words

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
