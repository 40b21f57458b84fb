"""The main table as people read it: every case by estimator, the best of a case marked."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from ..formatting import interval, number
from .results import METRICS, Results
from .tables import cases, consistency, costs, records

Key: TypeAlias = tuple[str, str]
"""case and estimator"""
LESS_IS_BEST = ("ate", "held_out", "divergence", "reprojection", "reprojection_common", "seconds")
MORE_IS_BEST = ("under_3px",)
WITH_INTERVAL = ("ate", "held_out", "divergence")
ELSEWHERE = ("nees", "nees_reference")
"""metrics that only the files have: for the page there is the ANEES"""
ANEES = {"too sure": " ↑", "too cautious": " ↓"}
COST_COLUMNS = (("seconds", "time, s"), ("memory_mb", "peak memory, MB"))
CAPTION = (
    "Means over the runs of a case; of errors in m and of held-out tracks with 95 % intervals where there are several "
    "runs (Student's t). Error to truth after SE(3) alignment (RMSE); divergence from the reference of each run (RMSE);"
    " both over the frames that all estimators of a run have; coverage is the share of the time in which an estimator "
    "has poses. Reprojection is the median over all observations, 'of common' over those that every estimator used. "
    "ANEES: 6 is consistent; ↑ marks estimators that are surer than they may be, ↓ those less sure, by chi-square at "
    "95 %. Best of a case in bold."
)


@dataclass(frozen=True, slots=True)
class Row:
    """An estimator in a case."""

    case: str
    estimator: str
    cells: tuple[str, ...]
    best: tuple[bool, ...]
    reason: str
    """why there is no cell at all"""
    reference: bool

    @property
    def name(self) -> str:
        """The estimator, and whether it is the reference."""
        return f"{self.estimator} (reference)" if self.reference else self.estimator


@dataclass(frozen=True, slots=True)
class Grid:
    """A table in words."""

    headings: tuple[str, ...]
    rows: tuple[Row, ...]
    caption: str

    @property
    def by_case(self) -> list[tuple[str, list[Row]]]:
        """The rows of each case."""
        return [(case, list(rows)) for case, rows in groupby(self.rows, key=lambda row: row.case)]


@dataclass(frozen=True, slots=True)
class _Column:
    heading: str
    cells: Mapping[Key, str]
    best: frozenset[Key] = frozenset()


def main_grid(results: Results, *, with_costs: bool) -> Grid:
    """Every case by estimator; what a run costs differs from time to time, and stands in it only where asked for."""
    table = _by_key(cases(results))
    columns = [*_metrics(table), *_anees(results), *(_costs(results) if with_costs else ())]
    if any(row["failed"] for row in table.values()):
        columns.append(
            _Column("answered", {k: f"{row['runs'] - row['failed']} of {row['runs']}" for k, row in table.items()})
        )
    references, rows = results.references, []
    for key, row in table.items():
        cells = tuple(column.cells.get(key, number(None)) for column in columns)
        reason = _reason(results, key) if row["failed"] == row["runs"] else ""
        best = tuple(key in column.best for column in columns)
        rows.append(Row(*key, cells, best, reason, references.get(key[0]) == key[1]))
    return Grid(tuple(column.heading for column in columns), tuple(rows), CAPTION)


def _metrics(table: Mapping[Key, Mapping[str, Any]]) -> Iterator[_Column]:
    known = next(iter(table.values()))
    for metric in METRICS:
        if metric.name not in known or metric.name in ELSEWHERE:
            continue
        bounds = (f"{metric.name}_low", f"{metric.name}_high") if metric.name in WITH_INTERVAL else ("", "")
        cells = {
            key: interval(row[metric.name], *(row.get(bound, np.nan) for bound in bounds)) for key, row in table.items()
        }
        yield _Column(metric.heading, cells, _best({key: row[metric.name] for key, row in table.items()}, metric.name))


def _anees(results: Results) -> Iterator[_Column]:
    judged = _by_key(consistency(results))
    if judged:
        cells = {key: number(row["anees"]) + ANEES.get(row["verdict"], "") for key, row in judged.items()}
        yield _Column("ANEES", cells)


def _costs(results: Results) -> Iterator[_Column]:
    spent = _by_key(costs(results))
    for name, heading in COST_COLUMNS:
        values = {key: float(row[name]) for key, row in spent.items()}
        if any(np.isfinite(value) for value in values.values()):
            yield _Column(heading, {key: number(value) for key, value in values.items()}, _best(values, name))


def _best(values: Mapping[Key, float], metric: str) -> frozenset[Key]:
    """Who is the best of each case; where all are alike or alone, nobody is, nor is the reference nearest to itself."""
    if metric not in (*LESS_IS_BEST, *MORE_IS_BEST):
        return frozenset()
    sign = 1.0 if metric in LESS_IS_BEST else -1.0
    best: set[Key] = set()
    for case in {case for case, _ in values}:
        own = {key: sign * value for key, value in values.items() if key[0] == case and np.isfinite(value)}
        if metric == "divergence":
            own = {key: value for key, value in own.items() if value > 0.0}
        if len(set(own.values())) > 1:
            least = min(own.values())
            best |= {key for key, value in own.items() if value == least}
    return frozenset(best)


def _by_key(table: pd.DataFrame) -> dict[Key, dict[str, Any]]:
    return {(row["case"], row["estimator"]): row for row in records(table)}


def _reason(results: Results, key: Key) -> str:
    runs = results.runs
    return str(runs[(runs["case"] == key[0]) & (runs["estimator"] == key[1])]["reason"].iloc[0])
