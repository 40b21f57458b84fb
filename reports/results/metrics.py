"""Definitions of the metrics: where each stands in the results, and how tables, files and glossary show it.

One `Metric` in `METRICS` adds a figure to every table that its `tables` name. With `measure` it is a new key of an
estimator in `summary.json` or `comparison.json` as well.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Flag, auto
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fgbaseline.compare import time_coverage
from fgbaseline.compare.limits import Better

from ..formatting import interval, number
from .json_tree import at

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Result, Run

LOWER, HIGHER, PERCENT = Better.LOWER, Better.HIGHER, 100.0


class Value(NamedTuple):
    """A figure, and its 95 % interval where it has one; NaN for what is missing."""

    value: float
    low: float = nan
    high: float = nan

    @property
    def text(self) -> str:
        """`0.52 [0.41, 0.66]`, the value alone, or a dash."""
        return interval(self.value, self.low, self.high)

    def __bool__(self) -> bool:
        """Whether there is a finite figure."""
        return isfinite(self.value)


class Tables(Flag):
    """Tables that a metric is a column of."""

    MAIN = auto()
    """of a run, on its page"""
    EVIDENCE = auto()
    """of a run, below the charts of its page"""
    TERMINAL = auto()
    """of a run"""
    BENCH = auto()
    COMPARISON = auto()


NONE = Tables(0)
MAIN, EVIDENCE, TERMINAL, BENCH, COMPARISON = Tables


@dataclass(frozen=True, slots=True)
class Metric:
    """A figure of an estimator, with one name, unit and direction everywhere."""

    path: tuple[str, ...]
    """keys below the estimator; `DELTA` stands for each delta of a relative error"""
    group: str
    """quantity, the heading above its columns"""
    title: str
    """statistic, the heading of its column"""
    unit: str = ""
    better: Better = Better.NEITHER
    tables: Tables = NONE
    scale: float = 1.0
    """of the figure in a table over that in the results"""
    term: str = ""
    """of the glossary, where it is not the group"""
    brief: str = ""
    """heading on the terminal and in a bench, where it is not the group"""
    name: str = ""
    """column of a bench's CSV tables; empty: none"""
    ranked: bool = False
    """whether a bench ranks by it: it measures accuracy"""
    same_data: bool = False
    """whether it is taken over the same data for all, so that it says which is best whatever each one covers"""
    uneven_only: bool = False
    """whether it stands in a run's table only where the estimators do not cover the same frames"""
    nonzero_only: bool = False
    """whether it stands in a run's table only where it is not 0 for all"""
    count: bool = False
    """whether it is a whole number"""
    absent: str = ""
    """why it may be missing, where the results do not say"""
    measure: "Callable[[Run, Result], float] | None" = None
    """its figure, where no model of the results has it"""

    @property
    def key(self) -> str:
        """Name in `metrics.csv` and limits: the path."""
        return ".".join(self.path)

    @property
    def short(self) -> str:
        """Heading without a group above it."""
        return self.brief or self.group

    @property
    def glossary_term(self) -> str:
        """Term of the glossary that explains it; empty where there is none."""
        term = self.term or self.group
        return term if term in TERMS else ""

    @property
    def full_title(self) -> str:
        """Group, title and unit."""
        return f"{self.group}: {self.title}, {self.unit}" if self.unit else f"{self.group}: {self.title}"

    @property
    def heading(self) -> str:
        """Short title and unit."""
        return f"{self.short}, {self.unit}" if self.unit else self.short

    def text(self, value: float) -> str:
        """A figure of it, without its unit."""
        return number(int(value) if self.count and isfinite(value) else value)

    def value(self, results: Mapping[str, Any]) -> Value:
        """Its figure in the results of one estimator."""
        return Value(*(self.scale * part for part in value_at(results, *self.path)))


def value_at(results: Mapping[str, Any], *path: str) -> Value:
    """The number at a path, or the mapping there with `value`, `low` and `high`."""
    found = at(results, *path)
    parts = [found.get(key) for key in Value._fields] if isinstance(found, Mapping) else [found]
    return Value(*map(_float, parts))


def _float(value: object) -> float:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else nan


def _coverage(run: "Run", result: "Result") -> float:
    t = run.problem.sequence.t
    return time_coverage(t[np.isfinite(result.estimate.world_T_imu[:, 0, 0])], t)


def _frames_per_second(run: "Run", result: "Result") -> float:
    seconds = result.estimate.seconds_total
    return run.problem.n_frames / seconds if seconds > 0 else nan


ATE, DIVERGENCE, RPE, DELTA = "ATE", "divergence", "relative error (RPE)", "DELTA"
REPROJECTION, HELD_OUT, MAP, SEGMENTS = "reprojection error", "held-out error", "map difference", "segment error"
NEES, REFERENCE_NEES, RESIDUALS, COST = "NEES", "reference NEES", "residuals of tracks", "cost"
COMMON = "RMSE over common frames"
NO_TRUTH = "no frame has both a pose and truth"
NO_LANDMARK = "no observed landmark was estimated"
NOT_MEASURED = "not measured"
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
    Metric(("ate", "rmse"), ATE, "RMSE", "m", LOWER, MAIN | TERMINAL, absent=NO_TRUTH),
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
    Metric(("ate", "max"), ATE, "max", "m", LOWER, MAIN, absent=NO_TRUTH),
    Metric(("translation", "rmse"), ATE, "RMSE", "m", LOWER, COMPARISON),
    Metric(("common", "rmse"), ATE, "RMSE over common moments", "m", LOWER, COMPARISON, same_data=True),
    Metric(("behind",), ATE, "RMSE above the smallest", "m", tables=COMPARISON),
    Metric(("translation", "max"), ATE, "max", "m", LOWER, COMPARISON),
    Metric(("rotation_deg", "rmse"), ATE, "rotation RMSE", "°", LOWER, COMPARISON),
    Metric(("nees", "median"), NEES, "median", tables=MAIN, absent="no positive definite covariance"),
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
    Metric(("divergence", "final"), DIVERGENCE, "final", "m", LOWER, MAIN),
    Metric(("divergence", "rotation_rmse_deg"), DIVERGENCE, "rotation RMSE", "°", LOWER, MAIN),
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
    Metric(("reprojection", "p95"), REPROJECTION, "95th percentile", "px", LOWER, MAIN, absent=NO_LANDMARK),
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
        absent="no observation was used by every estimator",
    ),
    Metric(
        ("reprojection_along", "median"), REPROJECTION, "median, triangulated along the path", "px", LOWER, COMPARISON
    ),
    Metric(
        ("observations", "share"),
        COST,
        "obs. used",
        "%",
        tables=MAIN | BENCH,
        scale=PERCENT,
        brief="observations used",
        name="used",
        absent="there are no observations",
    ),
    Metric(("seconds",), COST, "time", "s", LOWER, MAIN | TERMINAL, brief="time", same_data=True, absent=NOT_MEASURED),
    Metric(
        ("frames_per_second",),
        COST,
        "rate",
        "frames/s",
        HIGHER,
        MAIN,
        same_data=True,
        absent="it took no measurable time",
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
    Metric(("nees_reference", "median"), REFERENCE_NEES, "median", tables=EVIDENCE, name="nees_reference"),
    Metric(("nees_reference", "left_out"), REFERENCE_NEES, "frames left out", tables=EVIDENCE, count=True),
    Metric(("nis", "per_degree"), "consistency", "NIS per row", tables=EVIDENCE, term="NIS per row"),
    Metric(("sigma_ratio", "position"), "consistency", "sigma ratio, position", tables=EVIDENCE, term="sigma ratio"),
    Metric(
        ("covariance", "not_positive_definite"),
        "consistency",
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
TERMS: Mapping[str, str] = {
    "coverage": "Share of the recording's time (in a comparison: of the reference's) in which an estimator has poses.",
    ATE: "Distance of the positions from ground truth after SE(3) alignment, m; with raw inertial data after "
    "alignment in yaw and position; in a comparison from the reference, after the alignment that was asked for.",
    DIVERGENCE: "Distance of the positions from those of the reference, m, without alignment: all start at one pose.",
    RPE: "Error of the motion between two poses a delta apart, m and °.",
    "drift": "Relative error per meter (or second) over a tenth of the path.",
    SEGMENTS: "KITTI's relative error over segments of 100 to 800 m, % and °/m; shorter where the path is too short.",
    REPROJECTION: "Norm of the four pixel differences (uL, vL, uR, vR) of an observation, px. Common observations are "
    "those that every estimator used.",
    HELD_OUT: "Reprojection error of tracks that no estimator used, each half predicted from the other along the "
    "path, px. It judges motion over a second or two, not drift. A path is separated from the best where "
    "'above the best by at least' is positive.",
    NEES: "Normalized estimation error squared of a pose, e^T P^-1 e with e = log(T^-1 T_true): 6 is expected of a "
    "consistent estimator, 5.35 in the median. A larger figure means that it is overconfident.",
    REFERENCE_NEES: "Squared difference from the reference over P − P_ref, as both share their data: 5.35 is expected "
    "in the median. Frames where P − P_ref is not positive definite are left out.",
    "NIS per row": "Squared innovations of a filter over their covariance, per degree of freedom: 1 is expected.",
    "sigma ratio": "Sigma of an estimator over that of the reference, median of the frames: a filter's is above 1.",
    RESIDUALS: "Squared residuals of a track over the noise assumed, per degree of freedom: 1 is expected. A point is "
    "dynamic where a constant velocity explains its residuals: it moved, or its track slid.",
    MAP: "Distance of landmarks from the reference's of the same number, m; in the frame of each one's own camera it "
    "is without drift. 1.54 sigmas of P − P_ref are expected.",
}
"""term -> definition, in the glossary of every page; docs/glossary.md has the formulas"""


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


MEASURED = tuple(metric for metric in METRICS if metric.measure is not None)


def measured(run: "Run", result: "Result") -> dict[str, float]:
    """Figures of the metrics that have their own `measure`, by key."""
    return {metric.path[0]: metric.measure(run, result) for metric in MEASURED if metric.measure is not None}
