"""Jobs of a bench, its results, a row per run and estimator, and their statistics: cases, rankings, consistency, costs.

A case is a sequence with its settings; its runs differ in the seed. Jobs are plain data for any process on any machine.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.geometry import FloatArray

from .metric_record import Metric
from .metric_registry import METRICS, PERCENT

OF_THE_RUN = ("run", "case", "sequence", "seed", "reference", "trust", "frames", "features", "observations")
COSTS = ("run", "case", "estimator", "frames", "observations", "seconds", "memory_mb")
ANSWERED = ("ok", "recovered")
BENCH_METRICS = tuple(metric for metric in METRICS if metric.name)
"""metrics that the CSV tables of a bench have as columns"""


@dataclass(frozen=True, slots=True)
class File:
    """An input file of a job."""

    path: str
    """absolute; workers on other machines need it under the same path"""
    content: str
    """SHA-256"""


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording."""

    recording: File
    truth: File | None = None
    truth_frame: Literal["camera", "imu"] | None = None
    repairs: File | None = None


@dataclass(frozen=True, slots=True)
class Simulated:
    """A simulated drive."""

    settings: Mapping[str, Any]
    """settings of `Simulation`, without the seed"""


@dataclass(frozen=True, slots=True)
class Job:
    """Job of a bench: all inputs that determine the results of one run."""

    source: Recorded | Simulated
    seed: int
    preset: Literal["calibrated", "documented"]
    features: int | Literal["all"] | None
    noise: str | Mapping[str, float]
    """`estimated`, `assumed`, or standard deviations by name"""
    landmarks: Literal["in-turn", "held"]
    held_out: float
    estimators: tuple[str, ...]
    page: Literal["none", "tables", "figures"]
    code: str
    """hash of the code that the job runs"""

    @property
    def key(self) -> str:
        """Cache key: the same for the same content, settings and code, whatever the paths of files."""
        content = asdict(self)
        for file in content["source"].values():
            if isinstance(file, dict):
                file.pop("path", None)
        content["kind"] = type(self.source).__name__
        return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()[:20]

    def record(self) -> dict[str, str | int | float | bool | None]:
        """The settings for `summary.json` of the run."""
        if isinstance(self.source, Recorded):
            source = {"sequence": self.source.recording.path}
        else:
            source = {"sequence": "simulated", **{name: str(value) for name, value in self.source.settings.items()}}
        return {
            **source,
            "preset": self.preset,
            "estimators": ",".join(self.estimators),
            "features": self.features or "the preset's default",
            "noise": self.noise if isinstance(self.noise, str) else json.dumps(dict(self.noise)),
            "landmarks": self.landmarks,
            "seed": self.seed,
            "held_out": self.held_out,
        }


@dataclass(frozen=True, slots=True)
class Planned:
    """A job with its names in tables."""

    job: Job
    case: str
    """sequence and settings: the jobs of a case differ only in the seed"""
    sequence: str
    settings: Mapping[str, str]
    """settings that vary over the suite, as text"""
    work: float
    """number of observations, to predict the remaining time"""
    has_seed: bool

    @property
    def name(self) -> str:
        """Name of the run, unique in the suite."""
        return f"{self.case} seed={self.job.seed}" if self.has_seed else self.case


@dataclass(frozen=True, eq=False, slots=True)
class Results:
    """All runs of a bench."""

    planned: Sequence[Planned]
    runs: pd.DataFrame
    """one row per run and estimator: `OF_THE_RUN`, the settings that vary, estimator, status, reason and the metrics"""
    costs: pd.DataFrame
    """`COSTS`, one row per run and estimator"""
    summaries: Mapping[str, Mapping[str, Any]]
    """summaries of the runs that did not fail, by name, without timings"""
    failures: Mapping[str, str]
    """reasons of failed runs, by name"""
    nees: Mapping[tuple[str, str], list[FloatArray]]
    """(T,) of each run that has any, by case and estimator"""
    seconds: float
    """computation time of all runs, s"""

    @property
    def cases(self) -> list[str]:
        """Names of the cases in the suite's order."""
        return list(dict.fromkeys(planned.case for planned in self.planned))

    @property
    def estimators(self) -> list[str]:
        """Names of the estimators in the suite's order."""
        return list(self.planned[0].job.estimators)

    @property
    def references(self) -> dict[str, str]:
        """The reference of each case, where all its runs have the same."""
        of_case = {str(case): set(names) for case, names in self.runs.groupby("case")["reference"]}
        return {case: str(*names) for case, names in of_case.items() if len(names) == 1}

    @property
    def reference(self) -> str | None:
        """The reference of all runs that did not fail; None where they have different ones, or there are none."""
        names = {str(summary["reference"]["name"]) for summary in self.summaries.values()}
        return names.pop() if len(names) == 1 else None


def cases(results: Results) -> pd.DataFrame:
    """One row per case and estimator: runs, how many failed, and each metric's mean over seeds, `_low` and `_high`.

    Intervals are cut where a metric has no values: below zero, and of shares above one.
    """
    rows: list[dict[str, Any]] = []
    for case, estimator, group in _groups(results):
        row: dict[str, Any] = {
            "case": case,
            "estimator": estimator,
            "runs": len(group),
            "failed": int((~group["status"].isin(ANSWERED)).sum()),
            "trust": _least(group["trust"]),
        }
        for metric in BENCH_METRICS:
            mean = compare.mean_interval(group[metric.name].to_numpy(dtype=np.float64))
            low, high = max(mean.low, 0.0), min(mean.high, 1.0 if metric.scale == PERCENT else np.inf)
            row |= {metric.name: mean.value, f"{metric.name}_low": low, f"{metric.name}_high": high}
        rows.append(row)
    table = pd.DataFrame(rows)
    empty = [name for name in table if name not in ("case", "estimator", "trust") and table[name].isna().all()]
    return table.drop(columns=empty)


def rankings(results: Results) -> pd.DataFrame:
    """Estimators ranked in every case by each metric of accuracy: see `compare.monte_carlo_ranking`."""
    parts = []
    for case in results.cases:
        for metric in (metric for metric in BENCH_METRICS if metric.ranked):
            of_case = results.runs[results.runs["case"] == case]
            ranked = compare.monte_carlo_ranking(_wide(of_case, metric.name, results.estimators)).reset_index()
            if len(ranked):
                ranked["low"] = ranked["low"].clip(lower=0.0)
                ranked.insert(0, "metric", metric.name)
                ranked.insert(0, "case", case)
                parts.append(ranked)
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def overall(results: Results) -> pd.DataFrame:
    """The mean rank of each estimator over all cases, and its interval; empty where there is but one case.

    A case counts once, however many seeds it has. An estimator without an answer in a case comes last there.
    """
    ranked, rows = rankings(results), []
    for metric in dict.fromkeys(ranked["metric"]) if len(ranked) else ():
        of_metric = ranked[ranked["metric"] == metric].pivot_table(index="case", columns="estimator", values="rank")
        places = of_metric.reindex(columns=results.estimators).fillna(len(results.estimators))
        if len(places) < 2:
            continue
        means = {name: compare.mean_interval(places[name].to_numpy(dtype=np.float64)) for name in places}
        for name, mean in sorted(means.items(), key=lambda item: item[1].value):
            low, high = max(mean.low, 1.0), min(mean.high, float(len(means)))
            rows.append((metric, name, mean.n, mean.value, low, high, int((places[name] == 1).sum())))
    return pd.DataFrame(rows, columns=["metric", "estimator", "cases", "mean_rank", "low", "high", "first"])


def consistency(results: Results) -> pd.DataFrame:
    """ANEES of each estimator over the runs of a case that has truth, with chi-square bounds and verdict."""
    rows = []
    for case in results.cases:
        for name in results.estimators:
            columns = results.nees.get((case, name))
            if columns is None:
                continue
            found = compare.anees_summary(columns)
            rows.append({"case": case, "estimator": name, **found._asdict(), "verdict": found.verdict})
    return pd.DataFrame(rows)


def nees_over_time(results: Results) -> pd.DataFrame:
    """ANEES frame by frame of each case and estimator, with its bounds: see `compare.average_nees`."""
    tables = {key: compare.average_nees(columns) for key, columns in results.nees.items()}
    return pd.concat(tables, names=["case", "estimator"]).reset_index() if tables else pd.DataFrame()


def costs(results: Results) -> pd.DataFrame:
    """One row per case and estimator: seconds (mean over seeds, interval), ms a frame and the largest peak memory."""
    rows = []
    for (case, estimator), group in results.costs.groupby(["case", "estimator"], sort=False):
        seconds = compare.mean_interval(group["seconds"].to_numpy(dtype=np.float64))
        each_frame = 1e3 * float((group["seconds"] / group["frames"]).mean())
        memory = float(group["memory_mb"].astype(np.float64).max())
        rows.append((case, estimator, seconds.value, seconds.low, seconds.high, each_frame, memory))
    columns = ["case", "estimator", "seconds", "seconds_low", "seconds_high", "ms_per_frame", "memory_mb"]
    return pd.DataFrame(rows, columns=columns)


def judge(results: Results) -> Metric | None:
    """Metric of accuracy: ATE, else the held-out error, else none."""
    ranked = (metric for metric in BENCH_METRICS if metric.ranked)
    return next((metric for metric in ranked if results.runs[metric.name].notna().any()), None)


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows, by column."""
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def _groups(results: Results) -> Iterator[tuple[str, str, pd.DataFrame]]:
    for case in results.cases:
        of_case = results.runs[results.runs["case"] == case]
        for name in results.estimators:
            group = of_case[of_case["estimator"] == name]
            if len(group):
                yield case, name, group


def _wide(runs: pd.DataFrame, metric: str, estimators: list[str]) -> pd.DataFrame:
    return runs.set_index(["run", "estimator"])[metric].unstack("estimator").reindex(columns=estimators)  # noqa: PD010


def _least(trust: pd.Series) -> str:
    """The worst trust in the references of several runs."""
    found = set(trust.dropna())
    return next((word for word in ("untrusted", "doubtful", "trusted") if word in found), "")
