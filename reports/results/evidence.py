"""Consistency, residuals, map and held-out tracks in `summary.json`: models and how they are filled."""

import math
from dataclasses import asdict
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from fgbaseline import compare
from fgbaseline.compare import CovarianceState
from fgbaseline.compare.estimate_comparison import Evidence, Result, Run

from .parts import Nees, Number, Part, PoseSigma


class NeesInDetail(Nees):
    """NEES against ground truth, also of position and rotation alone."""

    position_mean: Annotated[Number, Field(description="of the position alone; 3 is expected")]
    rotation_mean: Annotated[Number, Field(description="of the rotation alone; 3 is expected")]
    inside_95: Annotated[
        Number, Field(description="share of the frames inside the 95 % bounds of a single one; frames are correlated")
    ]


class CovarianceCount(Part):
    """Validity of the pose covariances."""

    frames: Annotated[int, Field(description="with a covariance, valid or not")]
    held: Annotated[
        int, Field(description="of a pose that is fixed, such as the first; from raw inertial data that one in part")
    ]
    not_positive_definite: int
    where: Annotated[str, Field(description="frames that are not positive definite, such as '3, 7 to 9'")]


class ReferenceNees(Part):
    """Reference NEES: difference from the reference with the covariance P - P_ref; 6 is expected."""

    mean: Number
    median: Number
    inside_95: Annotated[Number, Field(description="share of the frames inside the 95 % bounds of a single one")]
    frames: int
    left_out: Annotated[int, Field(description="frames in which P - P_ref is not positive definite")]
    overconfident: Annotated[int, Field(description="frames in which P is smaller than P_ref in some direction")]


class SigmaRatio(Part):
    """Median over the frames of sigma over the reference's; above 1 is expected of a filter."""

    position: Number
    rotation: Number


class Nis(Part):
    """Normalized innovation squared of a filter, of the rows (uL, uR, (vL + vR) / 2), before kernel and gates."""

    per_degree: Annotated[Number, Field(description="over its degrees of freedom; 1 is expected")]
    low: Annotated[Number, Field(description="95 % bound of per_degree, innovations independent from frame to frame")]
    high: Number
    inside_95: Annotated[Number, Field(description="share of the frames inside their own 95 % bounds")]
    frames: int


class Whitened(Part):
    """Residuals of the used observations over the assumed noise, by track, against chi-square."""

    ratio: Annotated[Number, Field(description="squared residuals over their degrees of freedom; 1 is expected")]
    beyond_95: Annotated[Number, Field(description="share of the tracks beyond their 95 % quantile; 0.05 is expected")]
    spread_uL: Annotated[Number, Field(description="RMS in sigmas, a little below 1 expected")]
    spread_uR: Number
    spread_v: Number
    tracks: int


class MovedPoints(Part):
    """Dynamic points: tracks whose residuals a constant velocity of the point explains."""

    tracks: Annotated[int, Field(description="long enough for the test")]
    moved: int
    share: Number


class MapDifference(Part):
    """Differences of landmarks from the reference's of the same number."""

    n: int
    median: Annotated[Number, Field(description="distance in the world, drift included, m")]
    median_seen: Annotated[
        Number, Field(description="distance in the frame of each one's own camera, without drift, m")
    ]
    median_sigmas: Annotated[
        Number, Field(description="world distance over the covariance P - P_ref; 1.54 is expected")
    ]
    with_sigmas: int
    left_out: Annotated[int, Field(description="landmarks for which P - P_ref is not positive definite")]


class HeldOutError(Part):
    """Held-out error: tracks that no estimator used, each half predicted from the other, px."""

    rank: Annotated[int, Field(description="1 for the smallest median")]
    median: Number
    low: Annotated[Number, Field(description="of a 95 % interval of the median (block bootstrap)")]
    high: Number
    behind: Annotated[Number, Field(description="median minus the best one")]
    behind_low: Annotated[
        Number, Field(description="of a 95 % interval; the two are not separated where it contains 0")
    ]
    behind_high: Number
    p95: Number
    under_3px: Annotated[Number, Field(description="share, 0 to 1")]


REFERENCE = "it is the reference"
SAME_GRAPH = "it solves the graph of the reference: P − P_ref is zero up to rounding"


def summarize_evidence(run: Run, result: Result) -> dict[str, Any]:
    """Parts of an estimator's summary that the models of this module describe; values may be NaN."""
    evidence = result.evidence
    moved = evidence.moved["moved"]
    return {
        "nees": None if evidence.nees is None else _nees(evidence.nees),
        "covariance": None if result.estimate.covariance is None else _covariance(evidence),
        "nees_reference": None if evidence.difference is None else _difference(evidence.difference),
        "sigma": summarize_sigma(evidence.sigma),
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


def evidence_notes(run: Run, result: Result) -> dict[str, str]:
    """Why a value of `summarize_evidence` may be null, by key."""
    alone = REFERENCE if result.name == run.reference else "there is no reference"
    no_covariance = "it gives no covariance" if result.estimate.covariance is None else ""
    no_truth = "" if result.evidence.nees is not None else "the recording has no ground truth"
    no_tracks = "none of its landmarks has enough observations"
    is_alone = result.evidence.difference is None
    comparable = result.evidence.difference is not None and result.evidence.difference.comparable.any()
    same_graph = SAME_GRAPH if result.name in run.same_graph else ""
    return {
        "nees": no_truth or no_covariance or "no frame has both ground truth and a positive definite covariance",
        "covariance": "it gives no covariance",
        "nees_reference": alone
        if is_alone
        else no_covariance
        or (
            same_graph or "P − P_ref is positive definite in no frame"
            if comparable
            else "no frame has two positive definite covariances"
        ),
        "sigma": no_covariance or "no pose has a positive definite covariance",
        "sigma_ratio": alone if is_alone else no_covariance or "no frame has two positive definite covariances",
        "nis": "it records no innovations",
        "whitened": no_tracks,
        "moved_points.share": no_tracks,
        "map": alone if is_alone else "it has no landmark in common with the reference",
        "map.median_sigmas": "no common landmark has covariances with P − P_ref positive definite",
        "held_out": "no tracks were held out" if run.held_out is None else "no held-out track remains",
        "held_out.p95": "more than 5 % of the points lie behind the camera",
    }


def _nees(table: pd.DataFrame) -> dict[str, float | int]:
    position, rotation = (compare.nees_summary(table[part].to_numpy())["mean"] for part in ("position", "rotation"))
    return {**compare.nees_summary(table["pose"].to_numpy()), "position_mean": position, "rotation_mean": rotation}


def _difference(difference: compare.ReferenceNees) -> dict[str, float | int]:
    return {
        **compare.nees_summary(difference.nees),
        "left_out": int(difference.left_out.sum()),
        "overconfident": int(difference.overconfident.sum()),
    }


def summarize_sigma(sigma: compare.PoseSigma) -> dict[str, float] | None:
    """Values of the model `PoseSigma`; None without a valid covariance."""
    values = {name: float(getattr(sigma, name)) for name in PoseSigma.model_fields}
    return values if math.isfinite(sigma.position_rmse) else None


def _covariance(evidence: Evidence) -> dict[str, int | str]:
    state = evidence.covariance
    bad = np.flatnonzero(state == CovarianceState.NOT_POSITIVE_DEFINITE)
    return {
        "frames": int(np.sum(state != CovarianceState.ABSENT)),
        "held": int(np.isin(state, (CovarianceState.HELD, CovarianceState.PARTLY_HELD)).sum()),
        "not_positive_definite": len(bad),
        "where": frame_ranges(bad),
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


def frame_ranges(frames: NDArray[np.int64]) -> str:
    """Rising frames as text, such as `3, 7 to 9`; empty for none."""
    if len(frames) == 0:
        return ""
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs)
