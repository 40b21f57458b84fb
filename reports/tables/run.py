"""Tables of a run: main figures and evidence of every estimator on the page, on the terminal and in metrics.csv."""

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline.compare.estimate_comparison import Run, same_frames
from fgbaseline.compare.limits import Better

from ..formatting import DASH, INFINITY, counted, number
from ..results.run import Summary
from ..results.tree import INFINITE, at, leaves
from .table import Cell, Column, Row, Table, best

LOWER, HIGHER = Better.LOWER, Better.HIGHER
PERCENT = 100.0
COVERAGE, TRUTH, REFERENCE, REPROJECTION, COST = (
    "coverage",
    "error to truth",
    "divergence",
    "reprojection error",
    "cost",
)
NO_TRUTH = "no frame has both a pose and truth"
NO_LANDMARK = "no observed landmark was estimated"
NBSP = "\N{NO-BREAK SPACE}"
COLUMNS = (
    Column("of the time", COVERAGE, "%", ("coverage",), scale=PERCENT),
    Column("RMSE", TRUTH, "m", ("ate", "rmse"), LOWER, absent=NO_TRUTH),
    Column("RMSE over common frames", TRUTH, "m", ("ate_common", "rmse"), LOWER, same_data=True),
    Column("largest", TRUTH, "m", ("ate", "max"), LOWER, absent=NO_TRUTH),
    Column("NEES, median", TRUTH, "", ("nees", "median"), absent="no positive definite covariance"),
    Column("RMSE", REFERENCE, "m", ("divergence", "rmse"), LOWER),
    Column("RMSE over common frames", REFERENCE, "m", ("divergence_common", "rmse"), LOWER, same_data=True),
    Column("largest", REFERENCE, "m", ("divergence", "max"), LOWER),
    Column("final", REFERENCE, "m", ("divergence", "final"), LOWER),
    Column("rotation RMSE", REFERENCE, "°", ("divergence", "rotation_rmse_deg"), LOWER),
    Column("median", REPROJECTION, "px", ("reprojection", "median"), LOWER, absent=NO_LANDMARK),
    Column(f"95{NBSP}%", REPROJECTION, "px", ("reprojection", "p95"), LOWER, absent=NO_LANDMARK),
    Column(f"under 3{NBSP}px", REPROJECTION, "%", ("reprojection", "under_3px"), HIGHER, PERCENT, absent=NO_LANDMARK),
    Column(
        "median of common",
        REPROJECTION,
        "px",
        ("reprojection_common", "median"),
        LOWER,
        absent="no observation was used by every estimator",
        same_data=True,
    ),
    Column("matches used", COST, "%", ("observations", "share"), scale=PERCENT, absent="there are no observations"),
    Column("time", COST, "s", ("seconds",), LOWER, absent="not measured", same_data=True),
    Column("frames per s", COST, "", ("frames_per_second",), HIGHER, absent="not measured", same_data=True),
)
UNEVEN_ONLY = ("coverage", "ate_common", "divergence_common")
"""figures that stand in the table only where the estimators do not cover the same frames"""
HELD_OUT, CONSISTENCY, RESIDUALS, MAP = "held-out tracks", "consistency", "tracks", "landmarks"
NOT_COVARIANCES = Column("not positive definite", CONSISTENCY, "", ("covariance", "not_positive_definite"))
"""shown only where there are any"""
EVIDENCE_COLUMNS = (
    Column("median", HELD_OUT, "px", ("held_out", "median"), LOWER, same_data=True),
    Column("behind the best", HELD_OUT, "px", ("held_out", "behind")),
    Column("by at least", HELD_OUT, "px", ("held_out", "behind_low")),
    Column("NEES, mean", CONSISTENCY, "", ("nees", "mean")),
    Column("NEES of difference, median", CONSISTENCY, "", ("nees_reference", "median")),
    Column("frames left out", CONSISTENCY, "", ("nees_reference", "left_out")),
    Column("NIS per row", CONSISTENCY, "", ("nis", "per_degree")),
    Column("position sigma over reference's", CONSISTENCY, "", ("sigma_ratio", "position")),
    NOT_COVARIANCES,
    Column("squared residuals over expected", RESIDUALS, "", ("whitened", "ratio")),
    Column("points that moved", RESIDUALS, "%", ("moved_points", "share"), scale=PERCENT),
    Column("median distance", MAP, "m", ("map", "median")),
    Column("as seen", MAP, "m", ("map", "median_seen")),
    Column("sigmas", MAP, "", ("map", "median_sigmas")),
)
EXPLAINED: Mapping[str, str] = {
    HELD_OUT: "Held-out tracks were kept from diagnosis and estimators; each half is predicted from the other half "
    "along each path. They judge motion over a second or two as these cameras see it, not drift. Where 'by at least' "
    "is not above 0 the bootstrap does not separate the path from the best.",
    CONSISTENCY: "Expected of a consistent estimator: 6 for NEES (5.35 in the median), 1 for NIS per row, sigmas above "
    "the reference's. The NEES of the difference has P − P_ref as covariance, as filter and reference share their "
    "data; frames where that is not positive definite are left out.",
    RESIDUALS: "Squared residuals of a track over the noise assumed: 1 is expected. Points moved, or their tracks "
    "slid, where a straight motion explains the residuals.",
    MAP: "Landmarks are matched with the reference's by number; 'as seen' is in the frame of each one's own camera, "
    "without drift; 1.54 sigmas are expected.",
}
Estimators = Mapping[str, Mapping[str, Any]]


def main_table(run: Run, estimators: Estimators) -> Table:
    """Every estimator's main figures from `estimators` of `summary.json`; figures that no estimator has are left out.

    What belongs to the reference's own run or graph is near to it by construction and is not called best.
    """
    table = _table(run, estimators, COLUMNS)
    if not table.columns:
        return table
    near = "; the reference, its by-products and other minima of its graph are not ranked by the distance from it"
    caption = (
        f"Best of a column in bold{near if run.reference is not None else ''}; figures that read the same are best "
        "together. Reprojection errors are norms of the four pixel differences over all observations of the landmarks "
        'that an estimator has; "common" are the observations that every estimator used.'
    )
    return Table(table.columns, table.rows, caption=caption, notes=table.notes)


def evidence_table(run: Run, estimators: Estimators) -> Table:
    """Held-out tracks, consistency, residuals and map of every estimator that gave an answer."""
    any_bad = any(at(e, "covariance", "not_positive_definite") for e in estimators.values())
    table = _table(run, estimators, [c for c in EVIDENCE_COLUMNS if c is not NOT_COVARIANCES or any_bad])
    caption = " ".join(EXPLAINED[group] for group in dict.fromkeys(column.group for column in table.columns))
    return Table(table.columns, tuple(r for r in table.rows if r.cells), caption=caption, notes=table.notes)


def terminal_table(estimators: Estimators, reference: str | None) -> Table:
    """The few figures of every estimator that a terminal has room for."""
    columns = [
        Column("seconds", path=("seconds",)),
        Column("reprojection", unit="px", path=("reprojection", "median")),
        Column("under 3 px", path=("reprojection", "under_3px")),
        Column("from the reference", unit="m", path=("divergence", "rmse")),
    ]
    if any(at(e, "ate") is not None for e in estimators.values()):
        columns.append(Column("ATE", unit="m", path=("ate", "rmse")))
    if len({e["coverage"] for e in estimators.values()}) > 1:
        columns.append(Column("coverage", path=("coverage",)))
    rows = []
    for name, e in estimators.items():
        texts = [e["status"]]
        for column in columns:
            value = column.value(e).value
            is_reference = column.path[0] == "divergence" and name == reference
            texts.append("reference" if is_reference else _short(column, value))
        rows.append(Row(name, tuple(map(Cell, texts))))
    return Table((Column("status", words=True), *columns), tuple(rows))


def _short(column: Column, value: float) -> str:
    if not isfinite(value):
        return "-"
    formats = {"seconds": ".1f", "under 3 px": ".0%", "coverage": ".1%"}
    return format(value, formats.get(column.title, ".3g" if abs(value) < 1000 else ".0f"))


def _table(run: Run, estimators: Estimators, chosen: Iterable[Column]) -> Table:
    answered = [name for name in run.results if name in estimators and run.results[name].answered]
    even = same_frames(np.isfinite(run.results[n].estimate.world_T_imu[:, 0, 0]) for n in answered)
    values = {c: {name: c.value(estimators[name]).value for name in answered} for c in chosen}
    columns = tuple(
        c
        for c, of_all in values.items()
        if any(map(isfinite, of_all.values()))
        and not (c.group == REFERENCE and len(answered) < 2)
        and not (even and c.path[0] in UNEVEN_ONLY)
    )
    rivals = {c: _rivals(run, c, answered) if even or c.same_data else set[str]() for c in columns}
    firsts = {c: best(c, {name: values[c][name] for name in rivals[c]}) for c in columns}
    notes: dict[str, str] = {}

    def cell(name: str, c: Column, i: int) -> Cell:
        if c.group == REFERENCE and name == run.reference:
            return Cell("reference" if i == 0 or columns[i - 1].group != REFERENCE else "")
        value, first = values[c][name], firsts[c]
        why = _left_out(estimators[name], c) if isfinite(value) else _why_absent(estimators[name], c)
        if why == INFINITE:
            return Cell(INFINITY)
        mark = notes.setdefault(why, chr(ord("a") + len(notes) % 26)) if why else ""
        if not isfinite(value):
            return Cell(DASH, note=mark)
        return Cell(number(value), first is not None and number(value) == number(first), mark)

    rows = tuple(
        Row(
            name,
            tuple(cell(name, c, i) for i, c in enumerate(columns)) if name in answered else (),
            reason=result.estimate.reason,
            status=result.estimate.status.value,
            reference=name == run.reference,
        )
        for name, result in run.results.items()
    )
    return Table(_named(columns, run.reference), rows, notes=tuple((mark, text) for text, mark in notes.items()))


def _named(columns: tuple[Column, ...], reference: str | None) -> tuple[Column, ...]:
    """The columns with the reference's name in the title of their group."""
    title = f"divergence from {reference}"
    return tuple(Column(c.title, title if c.group == REFERENCE else c.group, c.unit, c.path) for c in columns)


def _rivals(run: Run, column: Column, answered: list[str]) -> set[str]:
    return set(answered) - ({run.reference, *run.unranked} if column.group == REFERENCE else set())


def _why_absent(estimator: Mapping[str, Any], column: Column) -> str:
    """What the summary's notes say of a missing value, by its own key or that of what it belongs to."""
    notes: Mapping[str, str] = estimator.get("notes") or {}
    return notes.get(".".join(column.path)) or notes.get(column.path[0]) or column.absent or "no such figure"


def _left_out(estimator: Mapping[str, Any], column: Column) -> str:
    """How many errors a figure leaves out since they are missing; empty where it leaves out none."""
    missing = at(estimator, column.path[0], "missing") or 0
    return f"{counted(missing, 'error is', 'errors are')} missing (NaN) and left out" if missing else ""


def metrics_table(summary: Summary) -> pd.DataFrame:
    """`metrics.csv`: estimator, metric (its path in the summary) and value, one row for each number but the samples."""
    rows = [
        (name, metric, value)
        for name, estimator in summary.estimators.items()
        for metric, value in leaves(estimator.model_dump(exclude={"notes", "status", "reason", "samples"}))
        if value is None or isinstance(value, int | float)
    ]
    return pd.DataFrame(rows, columns=["estimator", "metric", "value"])
