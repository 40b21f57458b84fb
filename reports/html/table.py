"""The table on top of the page: a row for each estimator, a column for each main figure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import isfinite
from typing import Any

import numpy as np

from fgbaseline.reports.common_frames import same_frames
from fgbaseline.reports.comparison import Run
from fgbaseline.reports.figures import colors
from fgbaseline.reports.results.tree import INFINITE

from ..formatting import DASH, INFINITY, counted, number
from .accuracy_verdict import unranked


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
    own_frames: bool = False
    """whether it is taken over the frames that each one has: it says which is best only where these are the same"""
    uneven: bool = False
    """whether it stands in the table only where they are not the same"""


COVERAGE, TRUTH, REFERENCE, REPROJECTION, COST = (
    "coverage",
    "error to truth",
    "divergence",
    "reprojection error",
    "cost",
)
NO_TRUTH = "no frame has both a pose and truth"
NO_LANDMARK = "no observed landmark was estimated"
COLUMNS = (
    Column(COVERAGE, "of the time, %", ("coverage",), 100.0, uneven=True),
    Column(TRUTH, "RMSE, m", ("ate", "rmse"), best=-1, own_frames=True, absent=NO_TRUTH),
    Column(TRUTH, "RMSE over common frames, m", ("ate_common", "rmse"), best=-1, uneven=True),
    Column(TRUTH, "largest, m", ("ate", "max"), best=-1, own_frames=True, absent=NO_TRUTH),
    Column(TRUTH, "NEES, median", ("nees", "median"), absent="no positive definite covariance"),
    Column(REFERENCE, "RMSE, m", ("divergence", "rmse"), best=-1, own_frames=True),
    Column(REFERENCE, "RMSE over common frames, m", ("divergence_common", "rmse"), best=-1, uneven=True),
    Column(REFERENCE, "largest, m", ("divergence", "max"), best=-1, own_frames=True),
    Column(REFERENCE, "final, m", ("divergence", "final"), best=-1, own_frames=True),
    Column(REFERENCE, "rotation RMSE, °", ("divergence", "rotation_rmse_deg"), best=-1, own_frames=True),
    Column(REPROJECTION, "median, px", ("reprojection", "median"), best=-1, own_frames=True, absent=NO_LANDMARK),
    Column(
        REPROJECTION, "95\N{NO-BREAK SPACE}%, px", ("reprojection", "p95"), best=-1, own_frames=True, absent=NO_LANDMARK
    ),
    Column(
        REPROJECTION,
        "under 3\N{NO-BREAK SPACE}px, %",
        ("reprojection", "under_3px"),
        100.0,
        best=1,
        own_frames=True,
        absent=NO_LANDMARK,
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
    Column(COST, "frames per s", ("frames_per_second",), best=1, absent="not measured"),
)


@dataclass(frozen=True, slots=True)
class Cell:
    """A figure as text, whether it is the best of its column, and the mark of the note on it.

    The note says why the figure is missing, or what it leaves out."""

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

    What belongs to the reference's own run or graph is near to it by nature and is not called best.
    """
    return table_of(run, estimators, COLUMNS)


def table_of(run: Run, estimators: Mapping[str, Mapping[str, Any]], chosen: Sequence[Column]) -> Table:
    """A table of some columns, as `main_table`."""
    answered = [name for name in run.results if name in estimators and run.results[name].answered]
    values = {c: {name: _value(estimators[name], c) for name in answered} for c in chosen}
    columns = [c for c in chosen if any(value is not None for value in values[c].values())]
    columns = [c for c in columns if c.group != REFERENCE or len(answered) > 1]
    even = same_frames(np.isfinite(run.results[n].estimate.world_T_imu[:, 0, 0]) for n in answered)
    columns = [c for c in columns if not (c.uneven and even)]
    opens = {c: i > 0 and columns[i - 1].group != c.group for i, c in enumerate(columns)}
    best = {c: None if c.own_frames and not even else _best(run, c, values[c]) for c in columns}
    best_text = {c: None if value is None else number(float(value) * c.scale) for c, value in best.items()}
    notes: dict[str, str] = {}

    def cell(name: str, c: Column) -> Cell:
        value = values[c][name]
        if c.group == REFERENCE and name == run.reference:
            return Cell("reference" if opens[c] or c is columns[0] else "", opens_group=opens[c])
        why = _why_absent(estimators[name], c) if value is None else _left_out(estimators[name], c)
        if why == INFINITE:
            return Cell(INFINITY, opens_group=opens[c])
        mark = notes.setdefault(why, chr(ord("a") + len(notes) % 26)) if why else ""
        if value is None:
            return Cell(DASH, note=mark, opens_group=opens[c])
        text = number(float(value) * c.scale)
        return Cell(text, best=text == best_text[c], note=mark, opens_group=opens[c])

    rows = [
        Row(
            name=name,
            colour=colour,
            status=run.results[name].estimate.status.value,
            reason=run.results[name].estimate.reason,
            reference=name == run.reference,
            cells=[cell(name, c) for c in columns] if name in answered else [],
        )
        for name, colour in colors(run.results, run.reference).items()
    ]
    groups = [
        (f"divergence from {run.reference}" if group == REFERENCE else group, len(list(same)))
        for group, same in groupby(c.group for c in columns)
    ]
    headings = [Cell(c.heading, opens_group=opens[c]) for c in columns]
    return Table(groups, headings, rows, [(mark, text) for text, mark in notes.items()])


def _why_absent(estimator: Mapping[str, Any], column: Column) -> str:
    """What the summary's notes say of a missing value, by its own key or that of what it belongs to."""
    notes: Mapping[str, str] = estimator.get("notes") or {}
    return notes.get(".".join(column.path)) or notes.get(column.path[0]) or column.absent


def _left_out(estimator: Mapping[str, Any], column: Column) -> str:
    """How many errors a figure leaves out since they are missing; empty where it leaves out none."""
    part = estimator.get(column.path[0])
    missing = part.get("missing", 0) if isinstance(part, Mapping) else 0
    return f"{counted(missing, 'error is', 'errors are')} missing (NaN) and left out" if missing else ""


def _best(run: Run, column: Column, values: Mapping[str, float | int | None]) -> float | int | None:
    known = {name: value for name, value in values.items() if value is not None}
    if column.group == REFERENCE:
        near_by_nature = {run.reference, *unranked(run)}
        known = {name: value for name, value in known.items() if name not in near_by_nature}
    if column.best == 0 or len(known) < 2:
        return None
    return min(known.values()) if column.best < 0 else max(known.values())


def _value(estimator: Mapping[str, Any], column: Column) -> float | int | None:
    value: Any = estimator
    for key in column.path:
        value = value.get(key) if isinstance(value, Mapping) else None
    return value if isinstance(value, int | float) and isfinite(value) else None
