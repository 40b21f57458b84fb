"""Definitions of the metrics: where each stands in the results, and how tables, files and glossary show it.

One `Metric` in `METRICS` adds a value to every table that its `tables` name. With `measure` it is a new key of an
estimator in `summary.json` as well; the keys of `comparison.json` are filled in `comparison_summary`. `metric_record`
has the record, `glossary` the terms.
"""

from collections.abc import Iterable
from dataclasses import replace
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from fgbaseline.compare import time_coverage
from fgbaseline.compare.acceptance_limits import Better
from fgbaseline.compare.trajectory_comparison.decimal_resolution import truth_resolution

from ..formatting import RESOLUTION
from . import glossary
from .inertial_metrics import BLOCK_NEES, SCALE, STATE_NEES, VELOCITY_AND_BIASES
from .metric_record import BENCH, COMPARISON, EVIDENCE, MAIN, TERMINAL, Metric, Tables

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Result, Run

LOWER, HIGHER, PERCENT = Better.LOWER, Better.HIGHER, 100.0
COMMON = "RMSE over common frames"
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
        "share of the time",
        "%",
        tables=MAIN | TERMINAL | BENCH | COMPARISON,
        scale=PERCENT,
        name="coverage",
        uneven_only=True,
        measure=_coverage,
    ),
    Metric(("ate", "rmse"), glossary.ATE, "RMSE, aligned", "m", LOWER, MAIN | TERMINAL, brief="ATE, aligned"),
    Metric(("ate_unaligned", "rmse"), glossary.ATE, "RMSE, unaligned", "m", LOWER, MAIN | TERMINAL, brief="unaligned"),
    Metric(
        ("ate_common", "rmse"),
        glossary.ATE,
        COMMON,
        "m",
        LOWER,
        MAIN | BENCH,
        name="ate",
        ranked=True,
        same_data=True,
        uneven_only=True,
    ),
    Metric(("ate", "max"), glossary.ATE, "max, aligned", "m", LOWER, EVIDENCE),
    Metric(("ate_unaligned", "final"), glossary.ATE, "final, unaligned", "m", LOWER, EVIDENCE),
    Metric(("translation", "rmse"), glossary.ATE, "RMSE", "m", LOWER, COMPARISON),
    Metric(("common", "rmse"), glossary.ATE, "RMSE over common stamps", "m", LOWER, COMPARISON, same_data=True),
    Metric(("behind",), glossary.ATE, "RMSE minus the smallest", "m", tables=COMPARISON),
    Metric(("translation", "mean"), glossary.ATE, "mean", "m", LOWER, COMPARISON),
    Metric(("translation", "median"), glossary.ATE, "median", "m", LOWER, COMPARISON),
    Metric(("translation", "std"), glossary.ATE, "standard deviation", "m", tables=COMPARISON),
    Metric(("translation", "min"), glossary.ATE, "min", "m", tables=COMPARISON),
    Metric(("translation", "max"), glossary.ATE, "max", "m", LOWER, COMPARISON),
    Metric(("rotation_deg", "rmse"), glossary.ATE, "rotation RMSE", "°", LOWER, COMPARISON),
    Metric(("divergence", "rmse"), glossary.DIVERGENCE, "RMSE", "m", LOWER, MAIN | TERMINAL),
    Metric(
        ("divergence_common", "rmse"),
        glossary.DIVERGENCE,
        COMMON,
        "m",
        LOWER,
        MAIN | BENCH,
        name="divergence",
        same_data=True,
        uneven_only=True,
    ),
    Metric(("divergence", "max"), glossary.DIVERGENCE, "max", "m", LOWER, MAIN),
    Metric(("divergence", "final"), glossary.DIVERGENCE, "final", "m", LOWER, EVIDENCE),
    Metric(("divergence", "rotation_rmse_deg"), glossary.DIVERGENCE, "rotation RMSE", "°", LOWER, EVIDENCE),
    *SCALE,
    *VELOCITY_AND_BIASES,
    Metric(
        ("sigma", "position_rmse"),
        glossary.SIGMA,
        "claimed, RMS",
        "m",
        tables=MAIN | TERMINAL,
        brief="claimed sigma (3D)",
    ),
    Metric(("sigma", "position_final"), glossary.SIGMA, "claimed, final", "m", tables=EVIDENCE),
    Metric(("sigma_ratio", "position"), glossary.SIGMA, "ratio to reference", tables=MAIN, term="sigma ratio"),
    Metric(("nees", "median"), glossary.CONSISTENCY, "NEES, median (5.35 expected)", tables=MAIN, term=glossary.NEES),
    STATE_NEES,
    Metric(
        ("nees_reference", "median"),
        glossary.CONSISTENCY,
        "reference NEES, median (5.35 expected)",
        tables=MAIN,
        term=glossary.REFERENCE_NEES,
        name="nees_reference",
    ),
    Metric(("relative", glossary.DELTA, "translation", "rmse"), glossary.RPE, "RMSE", "m", LOWER, COMPARISON),
    Metric(("relative", glossary.DELTA, "rotation_deg", "rmse"), glossary.RPE, "rotation RMSE", "°", LOWER, COMPARISON),
    Metric(("drift", "translation"), "drift", "translation", "%", LOWER, COMPARISON),
    Metric(("drift", "rotation"), "drift", "rotation", "°/m", LOWER, COMPARISON),
    Metric(("segments", "intervals", "translation_percent"), glossary.SEGMENTS, "translation", "%", LOWER, COMPARISON),
    Metric(("segments", "intervals", "rotation_deg_per_m"), glossary.SEGMENTS, "rotation", "°/m", LOWER, COMPARISON),
    Metric(
        ("reprojection", "median"),
        glossary.REPROJECTION,
        "median",
        "px",
        LOWER,
        MAIN | TERMINAL | BENCH | COMPARISON,
        brief="median reprojection error",
        name="reprojection",
    ),
    Metric(("reprojection", "p95"), glossary.REPROJECTION, "95th percentile", "px", LOWER, EVIDENCE),
    Metric(
        ("reprojection", "under_3px"),
        glossary.REPROJECTION,
        "under 3\N{NO-BREAK SPACE}px",
        "%",
        HIGHER,
        MAIN | TERMINAL | BENCH,
        scale=PERCENT,
        brief="errors under 3 px",
        name="under_3px",
    ),
    Metric(
        ("reprojection_common", "median"),
        glossary.REPROJECTION,
        "median over common",
        "px",
        LOWER,
        MAIN | BENCH | COMPARISON,
        brief="reprojection error over common observations",
        name="reprojection_common",
        same_data=True,
    ),
    Metric(
        ("reprojection_along", "median"),
        glossary.REPROJECTION,
        "median, triangulated along the trajectory",
        "px",
        LOWER,
        COMPARISON,
    ),
    Metric(
        ("observations", "share"),
        glossary.OBSERVATIONS,
        "used, of unmasked",
        "%",
        tables=MAIN | BENCH,
        scale=PERCENT,
        brief="observations used",
        name="used",
    ),
    Metric(("seconds",), glossary.RUNTIME, "time", "s", LOWER, MAIN | TERMINAL, brief="time", same_data=True),
    Metric(
        ("frames_per_second",),
        glossary.RUNTIME,
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
        glossary.HELD_OUT,
        "median",
        "px",
        LOWER,
        EVIDENCE | BENCH | COMPARISON,
        name="held_out",
        ranked=True,
        same_data=True,
    ),
    Metric(("held_out", "behind"), glossary.HELD_OUT, "above the best", "px", tables=EVIDENCE),
    Metric(("held_out", "behind_low"), glossary.HELD_OUT, "above the best by at least", "px", tables=EVIDENCE),
    Metric(("nees", "mean"), glossary.NEES, "mean", tables=EVIDENCE | COMPARISON, name="nees"),
    *BLOCK_NEES,
    Metric(("nees_reference", "mean"), glossary.REFERENCE_NEES, "mean", tables=EVIDENCE),
    Metric(("nees_reference", "left_out"), glossary.REFERENCE_NEES, "frames left out", tables=EVIDENCE, count=True),
    Metric(
        ("nis", "per_degree"),
        glossary.CONSISTENCY,
        "NIS per degree of freedom",
        tables=EVIDENCE,
        term="NIS per degree of freedom",
    ),
    Metric(
        ("sigma_ratio", "rotation"), glossary.CONSISTENCY, "sigma ratio, rotation", tables=EVIDENCE, term="sigma ratio"
    ),
    Metric(
        ("covariance", "not_positive_definite"),
        glossary.CONSISTENCY,
        "covariances not positive definite",
        tables=EVIDENCE,
        term=glossary.NEES,
        nonzero_only=True,
        count=True,
    ),
    Metric(("whitened", "ratio"), glossary.RESIDUALS, "chi-square per degree of freedom", tables=EVIDENCE),
    Metric(
        ("moved_points", "share"), glossary.RESIDUALS, "tracks of dynamic points", "%", tables=EVIDENCE, scale=PERCENT
    ),
    Metric(("map", "median"), glossary.MAP, "median", "m", LOWER, EVIDENCE | COMPARISON),
    Metric(("map", "median_seen"), glossary.MAP, "median in the camera frame", "m", LOWER, EVIDENCE | COMPARISON),
    Metric(("map", "median_sigmas"), glossary.MAP, "median in sigmas", tables=EVIDENCE),
)


def shown_in(tables: Tables) -> list[Metric]:
    """Metrics that are columns of at least one of `tables`."""
    return [metric for metric in METRICS if tables & metric.tables]


def over_deltas(metrics: Iterable[Metric], deltas: Iterable[str]) -> list[Metric]:
    """Metrics with one of each delta in place of those of relative errors."""
    every, expanded = list(metrics), list[Metric]()
    relative = [metric for metric in every if glossary.DELTA in metric.path]
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
    """Values of the metrics with a `measure`, by key."""
    return {metric.path[0]: metric.measure(run, result) for metric in MEASURED if metric.measure is not None}
