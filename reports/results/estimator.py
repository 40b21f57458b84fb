"""Estimators in `summary.json`: models, how they are filled, and notes on missing values."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
import pandas as pd
from pydantic import Field, create_model

from fgbaseline import compare
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.compare.sample_sizes import samples

from .evidence import (
    CovarianceCount,
    HeldOutError,
    MapDifference,
    MovedPoints,
    NeesInDetail,
    Nis,
    ReferenceNees,
    SigmaRatio,
    Whitened,
    evidence_notes,
    summarize_evidence,
)
from .glossary import TERMS
from .inertial import QuantityDivergence, QuantityError, StateNees, inertial_notes, summarize_inertial
from .json_files import INFINITE, nulls
from .metric_record import Metric
from .metric_registry import MEASURED, NOT_MEASURED, measured
from .parts import Divergence, Number, Part, PoseSigma, Reprojection, Spread


class Component(Part):
    """Measured minus predicted pixel coordinate, px, over all observations of the estimated landmarks."""

    bias: Annotated[Number, Field(description="median")]
    spread: Annotated[Number, Field(description="1.4826 median absolute deviation: sigma of Gaussian residuals")]


class ObservationCount(Part):
    """Use of the observations of the problem."""

    offered: Annotated[int, Field(description="observations of the problem, after its mask")]
    used: int
    share: Number


class TruthCount(Part):
    """Frames of the metrics against ground truth."""

    frames: int
    missing: Annotated[int, Field(description="frames without ground truth or without a pose")]


class CommonRmse(Part):
    """RMSE over the frames that all ranked estimators have, m."""

    rmse: Number
    frames: int


Model = TypeVar("Model", bound=Part)


def with_measured(model: type[Model]) -> type[Model]:
    """The model of an estimator's results with a key for each metric that has its own `measure`."""
    fields: dict[str, Any] = {metric.path[0]: (Number, Field(description=_description(metric))) for metric in MEASURED}
    return create_model(model.__name__, __base__=model, __module__=model.__module__, __doc__=model.__doc__, **fields)


def _description(metric: Metric) -> str:
    return TERMS.get(metric.term or metric.group, f"{metric.title}, {metric.unit}")


@with_measured
class EstimatorSummary(Part):
    """One estimator."""

    status: Literal["ok", "recovered", "failed"]
    reason: Annotated[str, Field(description="why the status is not ok, in a sentence")]
    seconds: Annotated[Number, Field(description="computation time, s; null where it was not measured, as of a file")]
    reprojection: Annotated[Reprojection, Field(description="over all observations of its landmarks")]
    reprojection_used: Annotated[Reprojection, Field(description="over the observations it used")]
    reprojection_common: Annotated[Reprojection, Field(description="over the observations that every estimator used")]
    components: dict[str, Component]
    divergence: Divergence | None
    divergence_common: Annotated[
        CommonRmse | None, Field(description="over the frames that all ranked estimators have; ranks by it")
    ]
    ate_common: Annotated[CommonRmse | None, Field(description="ATE over the frames that all ranked estimators have")]
    ate: Annotated[
        Spread | None,
        Field(
            description="ATE: position error to ground truth, aligned in SE(3) (raw inertial data: yaw and position), m"
        ),
    ]
    ate_unaligned: Annotated[Divergence | None, Field(description="pose error to ground truth without alignment")]
    truth: TruthCount | None
    nees: NeesInDetail | None
    covariance: CovarianceCount | None
    nees_reference: ReferenceNees | None
    sigma: PoseSigma | None
    sigma_ratio: SigmaRatio | None
    nis: Nis | None
    whitened: Whitened
    moved_points: MovedPoints
    map: MapDifference | None
    held_out: HeldOutError | None
    landmarks: int
    observations: ObservationCount
    samples: Annotated[
        dict[str, dict[str, float]],
        Field(description="by the beginning of a metric's key path: sample size n, coverage of the time"),
    ]
    events: Annotated[dict[str, int], Field(description="kind of event -> count")]
    notes: Annotated[
        dict[str, str], Field(description="reasons of null values by key, valid for all below it; * for all")
    ]


class InertialEstimatorSummary(EstimatorSummary):
    """One estimator of a run on raw inertial data."""

    velocity: Annotated[QuantityError | None, Field(description="error after alignment in yaw and position, m/s")]
    velocity_unaligned: Annotated[QuantityError | None, Field(description="error without alignment, m/s")]
    gyroscope_bias: Annotated[QuantityError | None, Field(description="error, rad/s")]
    accelerometer_bias: Annotated[QuantityError | None, Field(description="error, m/s^2")]
    velocity_divergence: Annotated[QuantityDivergence | None, Field(description="from the reference, unaligned, m/s")]
    gyroscope_bias_divergence: Annotated[QuantityDivergence | None, Field(description="from the reference, rad/s")]
    accelerometer_bias_divergence: Annotated[QuantityDivergence | None, Field(description="from the reference, m/s^2")]
    nees_state: StateNees | None


TOO_FEW = "it has too few common frames with the other estimators to be ranked"


def summarize_estimator(run: Run, result: Result) -> dict[str, Any]:
    """Summary of an estimator, whose values may be NaN or infinite."""
    estimate, table = result.estimate, result.reprojection
    common = np.zeros(len(run.problem.excluded), dtype=np.bool_) if run.common is None else run.common
    offered, used = int(run.problem.mask.sum()), int(estimate.used.sum())
    values = {
        "status": str(estimate.status),
        "reason": estimate.reason,
        "seconds": estimate.seconds_total if estimate.seconds_total > 0.0 else math.nan,
        "reprojection": compare.reprojection_summary(table),
        "reprojection_used": compare.reprojection_summary(table[table["used"]]),
        "reprojection_common": compare.reprojection_summary(table[common[table["observation"]]]),
        "components": compare.component_summary(table),
        "divergence": None if result.divergence is None else compare.divergence_summary(result.divergence),
        "divergence_common": None if result.divergence_common is None else asdict(result.divergence_common),
        "ate_common": None if result.ate_common is None else asdict(result.ate_common),
        "ate": None if result.truth_aligned is None else compare.summarized(result.truth_aligned["position"]),
        "ate_unaligned": None if result.truth is None else compare.divergence_summary(result.truth),
        "truth": None if result.truth is None else _truth_count(result.truth),
        **measured(run, result),
        **summarize_evidence(run, result),
        **({} if run.problem.imu is None else summarize_inertial(result)),
        "landmarks": len(estimate.landmarks),
        "observations": {"offered": offered, "used": used, "share": used / offered if offered else math.nan},
        "samples": samples(run, result) if result.answered else {},
        "events": dict(sorted(Counter(event.kind for event in estimate.events).items())),
    }
    return {**values, "notes": _notes(run, result, nulls(values))}


def _notes(run: Run, result: Result, absent: Iterable[tuple[str, bool]]) -> dict[str, str]:
    """Reasons of null values by key, valid for all below it; `*` for all.

    `absent` are their paths, and whether a value is infinite.
    """
    estimate = result.estimate
    if not result.answered:
        return {"*": f"the estimator failed: {estimate.reason}"}
    reached = bool(np.isfinite(estimate.world_T_imu[-1]).all())
    last = "the last frame has no ground truth" if reached else "it did not reach the last frame"
    no_truth = result.truth is None
    reasons = {
        "reprojection": None if len(estimate.landmarks) else "it estimated no landmarks",
        "reprojection_used": None if estimate.used.any() else "it uses no observations",
        "reprojection_common": "it has none of the observations that every estimator used",
        "components": None if len(estimate.landmarks) else "it estimated no landmarks",
        "seconds": NOT_MEASURED,
        "divergence": "there is no reference to diverge from" if result.divergence is None else None,
        "divergence.final": "it or the reference did not reach the last frame",
        "divergence.rotation_final_deg": "it or the reference did not reach the last frame",
        "ate": "the recording has no ground truth" if no_truth else "no frame has both a pose and ground truth",
        "ate_common": "the recording has no ground truth" if no_truth else TOO_FEW,
        "divergence_common": "there is no reference to diverge from" if result.divergence is None else TOO_FEW,
        "ate_unaligned": "the recording has no ground truth" if no_truth else None,
        "ate_unaligned.final": last,
        "ate_unaligned.rotation_final_deg": last,
        "truth": "the recording has no ground truth",
        **evidence_notes(run, result),
        **({} if run.problem.imu is None else inertial_notes(run, result)),
        **{metric.key: metric.absent for metric in MEASURED},
        "observations.share": "the problem has no observations",
    }
    noted: dict[str, str] = {}
    for null, infinite in absent:
        if infinite:
            noted[null] = INFINITE
            continue
        key = next((k for k in (null, null.partition(".")[0]) if reasons.get(k)), null)
        noted[key] = reasons.get(key) or "it is not a finite number"
    return noted


def _truth_count(table: pd.DataFrame) -> dict[str, int]:
    frames = int(table["position"].notna().sum())
    return {"frames": frames, "missing": len(table) - frames}
