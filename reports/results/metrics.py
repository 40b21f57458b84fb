"""Definitions of the metrics: where each stands in the results, and how tables, files and glossary show it.

One `Metric` in `METRICS` adds a value to every table that its `tables` name. With `measure` it is a new key of an
estimator in `summary.json` or `comparison.json` as well. The glossary's terms stand beside the record (`metric.TERMS`).
"""

from collections.abc import Iterable
from dataclasses import replace
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.compare import time_coverage
from fgbaseline.compare.limits import Better
from fgbaseline.compare.trajectory_comparison.resolution import truth_resolution

from ..formatting import RESOLUTION
from .inertial_metrics import BLOCK_NEES, MAIN_STATE_NEES, VELOCITY_AND_BIASES
from .metric import (
    ATE,
    BENCH,
    COMPARISON,
    CONSISTENCY,
    DELTA,
    DIVERGENCE,
    EVIDENCE,
    HELD_OUT,
    MAIN,
    MAP,
    NEES,
    OBSERVATIONS,
    REFERENCE_NEES,
    REPROJECTION,
    RESIDUALS,
    RPE,
    RUNTIME,
    SEGMENTS,
    SIGMA,
    TERMINAL,
    Metric,
    Tables,
)
from .monocular_metrics import SCALE

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Result, Run

LOWER, HIGHER, PERCENT = Better.LOWER, Better.HIGHER, 100.0
COMMON = "RMSE over common frames"
NO_TRUTH = "no frame has both a pose and truth"
NO_LANDMARK = "no observed landmark was estimated"
NOT_MEASURED = "not measured"


def _coverage(run: "Run", result: "Result") -> float:
    t = run.problem.sequence.t
    return time_coverage(t[np.isfinite(result.estimate.world_T_imu[:, 0, 0])], t)


def _frames_per_second(run: "Run", result: "Result") -> float:
    seconds = result.estimate.seconds_total
    return run.problem.n_frames / seconds if seconds > 0 else nan


METRICS = (
    Metric(
        ("coverage",),
        "coverage",
        "of the time",
        "%",
        tables=MAIN | TERMINAL | BENCH | COMPARISON,
        scale=PERCENT,
        name="coverage",
        uneven_only=True,
        measure=_coverage,
    ),
    Metric(("ate", "rmse"), ATE, "RMSE, aligned", "m", LOWER, MAIN | TERMINAL, brief="ATE, aligned", absent=NO_TRUTH),
    Metric(
        ("ate_unaligned", "rmse"),
        ATE,
        "RMSE, unaligned",
        "m",
        LOWER,
        MAIN | TERMINAL,
        brief="unaligned",
        absent=NO_TRUTH,
    ),
    Metric(
        ("ate_common", "rmse"),
        ATE,
        COMMON,
        "m",
        LOWER,
        MAIN | BENCH,
        name="ate",
        ranked=True,
        same_data=True,
        uneven_only=True,
    ),
    Metric(("ate", "max"), ATE, "max, aligned", "m", LOWER, EVIDENCE, absent=NO_TRUTH),
    Metric(("ate_unaligned", "final"), ATE, "final, unaligned", "m", LOWER, EVIDENCE, absent=NO_TRUTH),
    Metric(("translation", "rmse"), ATE, "RMSE", "m", LOWER, COMPARISON),
    Metric(("common", "rmse"), ATE, "RMSE over common stamps", "m", LOWER, COMPARISON, same_data=True),
    Metric(("behind",), ATE, "RMSE above the smallest", "m", tables=COMPARISON),
    Metric(("translation", "mean"), ATE, "mean", "m", LOWER, COMPARISON),
    Metric(("translation", "median"), ATE, "median", "m", LOWER, COMPARISON),
    Metric(("translation", "std"), ATE, "standard deviation", "m", tables=COMPARISON),
    Metric(("translation", "min"), ATE, "min", "m", tables=COMPARISON),
    Metric(("translation", "max"), ATE, "max", "m", LOWER, COMPARISON),
    Metric(("rotation_deg", "rmse"), ATE, "rotation RMSE", "°", LOWER, COMPARISON),
    Metric(("divergence", "rmse"), DIVERGENCE, "RMSE", "m", LOWER, MAIN | TERMINAL),
    Metric(
        ("divergence_common", "rmse"),
        DIVERGENCE,
        COMMON,
        "m",
        LOWER,
        MAIN | BENCH,
        name="divergence",
        same_data=True,
        uneven_only=True,
    ),
    Metric(("divergence", "max"), DIVERGENCE, "max", "m", LOWER, MAIN),
    Metric(("divergence", "final"), DIVERGENCE, "final", "m", LOWER, EVIDENCE),
    Metric(("divergence", "rotation_rmse_deg"), DIVERGENCE, "rotation RMSE", "°", LOWER, EVIDENCE),
    *SCALE,
    *VELOCITY_AND_BIASES,
    Metric(("sigma", "position_rmse"), SIGMA, "claimed, RMS", "m", tables=MAIN | TERMINAL, brief="claimed sigma (3D)"),
    Metric(("sigma", "position_final"), SIGMA, "claimed, final", "m", tables=EVIDENCE),
    Metric(("sigma_ratio", "position"), CONSISTENCY, "sigma ratio", tables=MAIN, term="sigma ratio"),
    Metric(
        ("nees", "median"),
        CONSISTENCY,
        "NEES, median (5.35 expected)",
        tables=MAIN,
        term=NEES,
        absent="no positive definite covariance",
    ),
    *MAIN_STATE_NEES,
    Metric(
        ("nees_reference", "median"),
        CONSISTENCY,
        "reference NEES, median (5.35 expected)",
        tables=MAIN,
        term=REFERENCE_NEES,
        name="nees_reference",
    ),
    Metric(("relative", DELTA, "translation", "rmse"), RPE, "RMSE", "m", LOWER, COMPARISON),
    Metric(("relative", DELTA, "rotation_deg", "rmse"), RPE, "rotation RMSE", "°", LOWER, COMPARISON),
    Metric(("drift", "translation"), "drift", "translation", "%", LOWER, COMPARISON),
    Metric(("drift", "rotation"), "drift", "rotation", "°/m", LOWER, COMPARISON),
    Metric(("segments", "intervals", "translation_percent"), SEGMENTS, "translation", "%", LOWER, COMPARISON),
    Metric(("segments", "intervals", "rotation_deg_per_m"), SEGMENTS, "rotation", "°/m", LOWER, COMPARISON),
    Metric(
        ("reprojection", "median"),
        REPROJECTION,
        "median",
        "px",
        LOWER,
        MAIN | TERMINAL | BENCH | COMPARISON,
        name="reprojection",
        absent=NO_LANDMARK,
    ),
    Metric(("reprojection", "p95"), REPROJECTION, "95th percentile", "px", LOWER, EVIDENCE, absent=NO_LANDMARK),
    Metric(
        ("reprojection", "under_3px"),
        REPROJECTION,
        "under 3\N{NO-BREAK SPACE}px",
        "%",
        HIGHER,
        MAIN | TERMINAL | BENCH,
        scale=PERCENT,
        brief="under 3 px",
        name="under_3px",
        absent=NO_LANDMARK,
    ),
    Metric(
        ("reprojection_common", "median"),
        REPROJECTION,
        "median over common",
        "px",
        LOWER,
        MAIN | BENCH | COMPARISON,
        brief="reprojection error over common observations",
        name="reprojection_common",
        same_data=True,
        absent="no observation was used by every estimator with landmark updates",
    ),
    Metric(
        ("reprojection_along", "median"),
        REPROJECTION,
        "median, triangulated along the trajectory",
        "px",
        LOWER,
        COMPARISON,
    ),
    Metric(
        ("observations", "share"),
        OBSERVATIONS,
        "used, of unmasked",
        "%",
        tables=MAIN | BENCH,
        scale=PERCENT,
        brief="observations used",
        name="used",
        absent="there are no observations",
    ),
    Metric(
        ("seconds",), RUNTIME, "time", "s", LOWER, MAIN | TERMINAL, brief="time", same_data=True, absent=NOT_MEASURED
    ),
    Metric(
        ("frames_per_second",),
        RUNTIME,
        "rate",
        "frames/s",
        HIGHER,
        EVIDENCE,
        same_data=True,
        absent=NOT_MEASURED,
        measure=_frames_per_second,
    ),
    Metric(
        ("held_out", "median"),
        HELD_OUT,
        "median",
        "px",
        LOWER,
        EVIDENCE | BENCH | COMPARISON,
        name="held_out",
        ranked=True,
        same_data=True,
    ),
    Metric(("held_out", "behind"), HELD_OUT, "above the best", "px", tables=EVIDENCE),
    Metric(("held_out", "behind_low"), HELD_OUT, "above the best by at least", "px", tables=EVIDENCE),
    Metric(("nees", "mean"), NEES, "mean", tables=EVIDENCE | COMPARISON, name="nees"),
    *BLOCK_NEES,
    Metric(("nees_reference", "mean"), REFERENCE_NEES, "mean", tables=EVIDENCE),
    Metric(("nees_reference", "left_out"), REFERENCE_NEES, "frames left out", tables=EVIDENCE, count=True),
    Metric(
        ("nis", "per_degree"),
        CONSISTENCY,
        "NIS per degree of freedom",
        tables=EVIDENCE,
        term="NIS per degree of freedom",
    ),
    Metric(("sigma_ratio", "rotation"), CONSISTENCY, "sigma ratio, rotation", tables=EVIDENCE, term="sigma ratio"),
    Metric(
        ("covariance", "not_positive_definite"),
        CONSISTENCY,
        "covariances not positive definite",
        tables=EVIDENCE,
        term=NEES,
        nonzero_only=True,
        count=True,
    ),
    Metric(("whitened", "ratio"), RESIDUALS, "chi-square per degree of freedom", tables=EVIDENCE),
    Metric(("moved_points", "share"), RESIDUALS, "of dynamic points", "%", tables=EVIDENCE, scale=PERCENT),
    Metric(("map", "median"), MAP, "median", "m", LOWER, EVIDENCE | COMPARISON),
    Metric(("map", "median_seen"), MAP, "median in the camera frame", "m", LOWER, EVIDENCE | COMPARISON),
    Metric(("map", "median_sigmas"), MAP, "median in sigmas", tables=EVIDENCE),
)


def shown_in(tables: Tables) -> list[Metric]:
    """Metrics that are columns of one of these tables."""
    return [metric for metric in METRICS if tables & metric.tables]


def over_deltas(metrics: Iterable[Metric], deltas: Iterable[str]) -> list[Metric]:
    """Metrics with one of each delta in place of those of relative errors."""
    every, expanded = list(metrics), list[Metric]()
    relative = [metric for metric in every if DELTA in metric.path]
    for metric in every:
        if metric not in relative:
            expanded.append(metric)
        elif metric is relative[0]:
            expanded += [
                replace(m, path=(m.path[0], delta, *m.path[2:]), group=f"{m.group} over {delta}", term=m.group)
                for delta in deltas
                for m in relative
            ]
    return expanded


def ate_resolution(run: "Run") -> float:
    """ATE below which there is only rounding, m: that of the estimates or of the decimals of the ground truth."""
    return max(RESOLUTION, truth_resolution(run.problem.sequence.truth))


MEASURED = tuple(metric for metric in METRICS if metric.measure is not None)


def measured(run: "Run", result: "Result") -> dict[str, float]:
    """Values of the metrics that have their own `measure`, by key."""
    return {metric.path[0]: metric.measure(run, result) for metric in MEASURED if metric.measure is not None}
