"""The table on top of the page: a row for each estimator, a column for each main figure."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from fgbaseline.reports.comparison import Run
from fgbaseline.reports.figures import colours

from .numbers import DASH, number
from .verdict import by_products


@dataclass(frozen=True, slots=True)
class Column:
    """A figure of `summary.json`, and how it stands in the table."""

    group: str
    heading: str
    path: tuple[str, ...]
    """of keys under `estimators.NAME`"""
    scale: float = 1.0
    best: int = 0
    """-1: the smallest is best, 1: the largest is, 0: neither says which is better"""
    absent: str = "no such figure"
    """why it may be missing"""


TRUTH, REFERENCE, REPROJECTION, COST = "error to truth", "divergence", "reprojection error", "cost"
NO_LANDMARK = "no observed landmark was estimated"
COLUMNS = (
    Column(TRUTH, "RMSE, m", ("ate", "rmse"), best=-1, absent="no frame has both a pose and truth"),
    Column(TRUTH, "largest, m", ("ate", "max"), best=-1, absent="no frame has both a pose and truth"),
    Column(TRUTH, "NEES, median", ("nees", "median"), absent="no positive definite covariance"),
    Column(REFERENCE, "RMSE, m", ("divergence", "rmse"), best=-1),
    Column(REFERENCE, "largest, m", ("divergence", "max"), best=-1),
    Column(REFERENCE, "final, m", ("divergence", "final"), best=-1),
    Column(REFERENCE, "rotation RMSE, °", ("divergence", "rotation_rmse_deg"), best=-1),
    Column(REPROJECTION, "median, px", ("reprojection", "median"), best=-1, absent=NO_LANDMARK),
    Column(REPROJECTION, "95\N{NO-BREAK SPACE}%, px", ("reprojection", "p95"), best=-1, absent=NO_LANDMARK),
    Column(
        REPROJECTION, "under 3\N{NO-BREAK SPACE}px, %", ("reprojection", "under_3px"), 100.0, best=1, absent=NO_LANDMARK
    ),
    Column(
        REPROJECTION,
        "median of common, px",
        ("reprojection_common", "median"),
        best=-1,
        absent="no observation was used by every estimator",
    ),
    Column(COST, "matches used, %", ("observations", "share"), 100.0, absent="there are no observations"),
    Column(COST, "time, s", ("seconds",), best=-1, absent="not measured"),
    Column(COST, "per frame, ms", ("seconds_per_frame",), 1e3, best=-1, absent="not measured"),
)


@dataclass(frozen=True, slots=True)
class Cell:
    """A figure as text, whether it is the best of its column, and the mark of the note that says why it is missing."""

    text: str
    best: bool = False
    note: str = ""
    opens_group: bool = False


@dataclass(frozen=True, slots=True)
class Row:
    """An estimator: its cells, or why it has none."""

    name: str
    colour: str
    status: str
    reason: str
    reference: bool
    cells: list[Cell]


@dataclass(frozen=True, slots=True)
class Table:
    """What the template lays out."""

    groups: list[tuple[str, int]]
    headings: list[Cell]
    rows: list[Row]
    notes: list[tuple[str, str]]
    """mark and text"""


def main_table(run: Run, estimators: Mapping[str, Mapping[str, Any]]) -> Table:
    """The table of `estimators` of `summary.json`: columns that no estimator of the run has are left out.

    What belongs to the reference's own run is near to it by nature and is not called best.
    """
    answered = [name for name in run.results if name in estimators and run.results[name].answered]
    columns = [c for c in COLUMNS if any(_value(estimators[name], c) is not None for name in answered)]
    columns = [c for c in columns if c.group != REFERENCE or len(answered) > 1]
    notes: dict[str, str] = {}
    rows = []
    best = {c: _best(run, c, {name: _value(estimators[name], c) for name in answered}) for c in columns}
    colour = colours(run)
    for name, result in run.results.items():
        cells = []
        if name in answered:
            for i, c in enumerate(columns):
                opens = i > 0 and columns[i - 1].group != c.group
                cells.append(_cell(run, name, c, _value(estimators[name], c), best[c], notes, opens))
        status, reason = result.estimate.status.value, result.estimate.reason
        rows.append(Row(name, colour[name], status, reason, name == run.reference, cells))
    groups: list[tuple[str, int]] = []
    for c in columns:
        title = f"divergence from {run.reference}" if c.group == REFERENCE else c.group
        same = bool(groups) and groups[-1][0] == title
        groups = [*groups[:-1], (title, groups[-1][1] + 1)] if same else [*groups, (title, 1)]
    headings = [Cell(c.heading, opens_group=i > 0 and columns[i - 1].group != c.group) for i, c in enumerate(columns)]
    return Table(groups, headings, rows, [(mark, text) for text, mark in notes.items()])


def _cell(
    run: Run,
    name: str,
    column: Column,
    value: float | int | None,
    best: float | None,
    notes: dict[str, str],
    opens: bool,
) -> Cell:
    if column.group == REFERENCE and name == run.reference:
        return Cell("reference" if column.heading == "RMSE, m" else "", opens_group=opens)
    if value is None:
        mark = notes.setdefault(f"{column.group}, {column.heading}: {column.absent}", chr(ord("a") + len(notes) % 26))
        return Cell(DASH, note=mark, opens_group=opens)
    return Cell(number(float(value) * column.scale), best=value == best, opens_group=opens)


def _best(run: Run, column: Column, values: Mapping[str, float | int | None]) -> float | int | None:
    known = {name: value for name, value in values.items() if value is not None}
    if column.group == REFERENCE:
        near_by_nature = {run.reference, *by_products(run)}
        known = {name: value for name, value in known.items() if name not in near_by_nature}
    if column.best == 0 or len(known) < 2:
        return None
    return min(known.values()) if column.best < 0 else max(known.values())


def _value(estimator: Mapping[str, Any], column: Column) -> float | int | None:
    value: Any = estimator
    for key in column.path:
        value = value.get(key) if isinstance(value, Mapping) else None
    return value if isinstance(value, int | float) and isfinite(value) else None
