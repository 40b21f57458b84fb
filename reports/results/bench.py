"""What the runs of a bench gave: one row per run and estimator, costs apart from what is the same every time."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline.geometry import FloatArray

from ..job import MARK
from ..results.tree import INFINITE
from .job import Planned
from .store import Store
from .work import COSTS


@dataclass(frozen=True, slots=True)
class Metric:
    """A figure of a run's summary."""

    name: str
    path: tuple[str, ...]
    """of keys under `estimators.NAME`"""
    title: str
    unit: str
    """empty for a number without one"""
    ranked: bool = False
    """whether less is better, and it stands for accuracy"""
    most: float = np.inf

    @property
    def heading(self) -> str:
        """Title and unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


METRICS = (
    Metric("ate", ("ate_common", "rmse"), "error to truth", "m", ranked=True),
    Metric("held_out", ("held_out", "median"), "held-out error", "px", ranked=True),
    Metric("divergence", ("divergence_common", "rmse"), "from the reference", "m"),
    Metric("reprojection", ("reprojection", "median"), "reprojection", "px"),
    Metric("reprojection_common", ("reprojection_common", "median"), "reprojection of common", "px"),
    Metric("under_3px", ("reprojection", "under_3px"), "under 3 px", "share", most=1.0),
    Metric("nees", ("nees", "mean"), "NEES", ""),
    Metric("nees_reference", ("nees_reference", "median"), "NEES from the reference", ""),
    Metric("coverage", ("coverage",), "coverage", "share", most=1.0),
    Metric("used", ("observations", "share"), "matches used", "share", most=1.0),
)
OF_THE_RUN = ("run", "case", "sequence", "seed", "reference", "trust", "frames", "features", "observations")
NOT_THE_SAME = ("seconds", "frames_per_second")
"""keys of an estimator's summary that two runs of one job differ in"""
ANSWERED = ("ok", "recovered")


@dataclass(frozen=True, eq=False, slots=True)
class Results:
    """All runs of a bench."""

    planned: Sequence[Planned]
    runs: pd.DataFrame
    """one row per run and estimator: `OF_THE_RUN`, the settings that vary, estimator, status, reason and `METRICS`"""
    costs: pd.DataFrame
    """run, case, estimator, frames, observations, seconds, memory_mb"""
    summaries: Mapping[str, Mapping[str, Any]]
    """of the runs that did not fail, by name, without timings"""
    failures: Mapping[str, str]
    """of whole runs, by name"""
    nees: Mapping[tuple[str, str], list[FloatArray]]
    """(T,) of each run that has any, by case and estimator"""
    seconds: float
    """of all runs together"""

    @property
    def cases(self) -> list[str]:
        """Their names in the suite's order."""
        return list(dict.fromkeys(planned.case for planned in self.planned))

    @property
    def estimators(self) -> list[str]:
        """Their names in the suite's order."""
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


def collected(planned: Sequence[Planned], store: Store) -> Results:
    """The results of jobs all of which are done."""
    rows: list[dict[str, Any]] = []
    costs: list[dict[str, Any]] = []
    summaries, failures = {}, {}
    nees: dict[tuple[str, str], list[FloatArray]] = {}
    for one in planned:
        failure = store.failure(one.job.key)
        if failure:
            failures[one.name] = failure
            rows += _failed(one, failure)
            continue
        folder = store.run(one.job.key)
        summary = json.loads((folder / MARK).read_text(encoding="utf-8"))
        of_run = _of_run(one, summary)
        spent = json.loads((folder / COSTS).read_text(encoding="utf-8"))["estimators"]
        for name, estimator in summary["estimators"].items():
            rows.append({**of_run, **_row(name, estimator)})
            if estimator["status"] in ANSWERED:
                costs.append({**of_run, "estimator": name, **spent[name]})
            if estimator["nees"] is not None:
                column = pd.read_csv(folder / "series" / f"{name}.csv", usecols=["nees"])["nees"]
                nees.setdefault((one.case, name), []).append(column.to_numpy(dtype=np.float64))
            for key in NOT_THE_SAME:
                del estimator[key]
        summaries[one.name] = summary
    seconds = sum(store.told(key)["seconds"] for key in {one.job.key for one in planned})
    cost_columns = ["run", "case", "estimator", "frames", "observations", "seconds", "memory_mb"]
    table = pd.DataFrame(costs, columns=cost_columns)
    return Results(planned, pd.DataFrame(rows), table, summaries, failures, nees, seconds)


def _of_run(one: Planned, summary: Mapping[str, Any]) -> dict[str, Any]:
    offered = next(iter(summary["estimators"].values()))["observations"]["offered"]
    values = (
        one.name,
        one.case,
        one.sequence,
        one.job.seed,
        summary["reference"]["name"],
        summary["reference"]["trust"],
        summary["sequence"]["frames"],
        summary["problem"]["features"],
        offered,
    )
    return {**dict(zip(OF_THE_RUN, values, strict=True)), **_settings(one)}


def _settings(one: Planned) -> dict[str, str]:
    return {f"{name}_asked": words for name, words in one.settings.items()}


def _row(name: str, estimator: Mapping[str, Any]) -> dict[str, Any]:
    values = {metric.name: _at(estimator, metric.path) for metric in METRICS}
    return {"estimator": name, "status": estimator["status"], "reason": estimator["reason"], **values}


def _failed(one: Planned, failure: str) -> list[dict[str, Any]]:
    of_run = dict(zip(OF_THE_RUN, (one.name, one.case, one.sequence, one.job.seed), strict=False))
    nothing = {metric.name: np.nan for metric in METRICS}
    return [
        {**of_run, **_settings(one), "estimator": name, "status": "failed", "reason": failure, **nothing}
        for name in one.job.estimators
    ]


def _at(estimator: Mapping[str, Any], path: tuple[str, ...]) -> float:
    value: Any = estimator
    for key in path:
        value = value.get(key) if isinstance(value, Mapping) else None
    if value is None and estimator["notes"].get(".".join(path)) == INFINITE:
        return float("inf")
    return float(value) if isinstance(value, int | float) else float("nan")
