"""Model of `summary.json` and how it is filled; `make schema` writes docs/summary.schema.json."""

import math
from dataclasses import asdict
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import Field

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data import Estimate, Excluded, Problem, Truth
from fgbaseline.data.top_view import TopView
from fgbaseline.geometry.path_length import path_length

from .estimator import EstimatorSummary, InertialEstimatorSummary, summarize_estimator
from .evidence import summarize_sigma
from .json_files import finite
from .parts import Document, Number, Part, PoseSigma
from .provenance import machine, versions

SCHEMA: Final = "fgbaseline/summary/1"
"""raised when a key is renamed, removed or changes its meaning; new keys do not raise it"""


class SequenceSummary(Part):
    """Recording."""

    name: str
    source: str
    form: str
    frames: int
    duration_s: float
    observations: int
    tracks: int
    path_length_m: Annotated[Number, Field(description="of ground truth, else of the reference; null without both")]
    up: Annotated[list[float], Field(description="unit vector that points up in the world of the trajectories")]
    ahead: Annotated[list[float], Field(description="horizontal unit vector of the optical axis at the start")]
    remarks: list[str]


class FindingSummary(Part):
    """Fault of the recording."""

    code: str
    sentence: str
    before: Annotated[Number, Field(description="value of the recording before repair, in `unit`")]
    after: Annotated[Number, Field(description="value after repair and mask")]
    unit: str
    certainty: str


class ProblemSummary(Part):
    """Problem that all estimators solve."""

    preset: str
    features: int
    diagnosed: bool
    excluded: Annotated[dict[str, int], Field(description="reason -> masked observations")]
    pixel_sigma: float
    pixel_inflation: Annotated[
        float, Field(description="factor in pixel_sigma for time-correlated track errors; 1 where there is none")
    ]
    remarks: list[str]
    findings: Annotated[list[FindingSummary], Field(description="faults that the diagnosis detected")]
    repairs: Annotated[list[str], Field(description="repairs, user-specified ones included")]


class CriterionSummary(Part):
    """Criterion of the trust in the reference."""

    code: str
    name: str
    value: Number
    unit: Annotated[str, Field(description="empty for ratios")]
    doubtful: Annotated[float, Field(description="limit beyond which the reference is doubtful")]
    untrusted: Annotated[float, Field(description="limit beyond which it is untrusted")]
    at_least: Annotated[bool, Field(description="whether the value must not fall below its limits, else not exceed")]
    verdict: Literal["trusted", "doubtful", "untrusted"]
    remark: str


class ReferenceSummary(Part):
    """Reference of the divergence, and the trust in it."""

    name: str | None
    trust: Literal["trusted", "doubtful", "untrusted"]
    reasons: Annotated[list[str], Field(description="reasons for the trust, worst first")]
    sigma: Annotated[
        PoseSigma | None, Field(description="possible distance of the reference itself from the truth; null without")
    ]
    criteria: Annotated[list[CriterionSummary], Field(description="measured values of the trust, limits and verdicts")]


class HeldOutSummary(Part):
    """Tracks that neither diagnosis nor estimators used."""

    share: float
    seed: int
    tracks: int
    observations: int
    pieces: Annotated[int, Field(description="segments of tracks without outliers, where all estimators have poses")]
    inliers: Annotated[int, Field(description="pieces that at least one trajectory explains, the same for all")]
    gate_px: Annotated[float, Field(description="error below which a trajectory explains a piece")]
    judged: Annotated[int, Field(description="observations of the errors, the same for all")]


class Summary(Document):
    """Summary of a run."""

    schema_: Annotated[Literal["fgbaseline/summary/1"], Field(alias="schema")] = SCHEMA
    sequence: SequenceSummary
    problem: ProblemSummary
    reference: ReferenceSummary
    held_out: Annotated[HeldOutSummary | None, Field(description="null where no tracks were held out")]
    estimators: dict[str, InertialEstimatorSummary | EstimatorSummary]
    added: Annotated[
        dict[str, str],
        Field(default_factory=dict, description="trajectories from files among the estimators: pairing and alignment"),
    ]
    settings: dict[str, str | int | float | bool | None]
    versions: dict[str, str]
    machine: dict[str, str | int]


def summarize(run: Run) -> Summary:
    """Summary of a run; a value that is not finite is None, with its reason in `notes`."""
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
                    "path_length_m": _path_length(run),
                    "up": sequence.up.tolist(),
                    "ahead": TopView.of(problem).ahead.tolist(),
                    "remarks": list(sequence.remarks),
                },
                "problem": {
                    "preset": problem.preset,
                    "features": len(problem.features),
                    "diagnosed": problem.diagnosed,
                    "excluded": _excluded_counts(problem),
                    "pixel_sigma": math.sqrt(problem.pixel_variance),
                    "pixel_inflation": problem.pixel_inflation,
                    "remarks": list(problem.remarks),
                    "findings": [asdict(finding) for finding in problem.findings],
                    "repairs": list(problem.repairs),
                },
                "reference": {
                    "name": run.reference,
                    "trust": run.trust.verdict.name.lower(),
                    "reasons": list(run.trust.reasons),
                    "sigma": None
                    if run.reference is None
                    else summarize_sigma(run.results[run.reference].evidence.sigma),
                    "criteria": [
                        {**asdict(criterion), "verdict": criterion.verdict.name.lower()}
                        for criterion in run.trust.criteria
                    ],
                },
                "held_out": _held_out(run),
                "estimators": {name: summarize_estimator(run, result) for name, result in run.results.items()},
                "added": dict(run.added),
                "settings": dict(run.settings),
                "versions": versions(),
                "machine": machine(),
            }
        )
    )


def _path_length(run: Run) -> float:
    """Length of the true path, else of the reference's, over the frames that have one, m."""
    path: Truth | Estimate | None = run.problem.sequence.truth
    if path is None and run.reference is not None:
        path = run.results[run.reference].estimate
    return math.nan if path is None else path_length(path.world_T_imu[:, :3, 3])


def _excluded_counts(problem: Problem) -> dict[str, int]:
    """Reason, in words -> how many observations of the sequence it excludes from the problem."""
    counts = np.bincount(problem.excluded, minlength=len(Excluded))
    return {
        reason.name.lower().replace("_", " "): int(counts[reason])
        for reason in Excluded
        if reason is not Excluded.NO and counts[reason]
    }


def _held_out(run: Run) -> dict[str, Any] | None:
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


if __name__ == "__main__":
    print(Summary.json_schema())
