"""Tables of a run that a page folds away: findings, residuals, map, components, exclusions and events."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data import Estimate
from fgbaseline.data.finding import Finding

from ..formatting import counted, number, per_cent, quantity
from ..results.tree import at
from .table import Cell, Column, Row, Table

ROWS = ("uL", "vL", "uR", "vR")
MAX_MOVED = 100
MAX_EVENTS = 200
"""of an estimator that are listed one by one"""
REASONS: Mapping[str, str] = {
    "feature not chosen": "its feature is not among those asked for",
    "disparity": "its disparity is too small to tell the depth",
    "rows": "its rows in the left and right image disagree",
    "prediction": "it contradicts its own track, carried along by the velocities",
    "short": "what is left of its track is too short to check",
    "geometry": "its point is not determined, or lies behind a camera",
    "moving": "its point moved",
    "copied": "it is a copy of the frame before and was never tracked",
}
"""why the mask excludes an observation"""


def findings_table(findings: Iterable[Finding]) -> Table:
    """Findings of the diagnosis before and after repair; the status is the certainty of what is not counted."""
    rows = tuple(
        Row(
            f.sentence,
            (Cell(quantity(f.before, f.unit)), Cell(quantity(f.after, f.unit))),
            status="ok" if f.certainty == "counted" else f.certainty,
        )
        for f in findings
    )
    return Table((Column("before"), Column("after")), rows, name="what the diagnosis found")


def _residuals(run: Run) -> Table:
    """Reprojection errors in classes."""
    tables = {r.name: r.evidence.patterns for r in run.answered}
    figures = {"n": "n", "median, px": "median", "mean, px": "mean", "95 %, px": "p95"}
    title = "Reprojection errors by distance, track age, place in the image and camera"
    return _frames(title, tables, {"by": "by", "class": "of"}, figures | {"mean u, px": "u", "mean v, px": "v"})


def _map(run: Run) -> Table:
    """Distances of landmarks from the reference's, by depth."""
    tables = {r.name: table for r in run.answered if (table := r.evidence.map_by_depth) is not None}
    figures = {"landmarks": "n", "distance, m": "distance", "as seen, m": "seen", "sigmas": "sigmas"}
    return _frames("Landmarks beside the reference's, medians by depth", tables, {"depth": "depth"}, figures)


def _moved(run: Run) -> Table:
    """Dynamic landmarks by the reference's residuals, the clearest first; empty without a reference."""
    if run.reference is None:
        return Table((), ())
    table = run.results[run.reference].evidence.moved
    moved = table[table["moved"]].sort_values("gain", ascending=False)
    more = f", the clearest {MAX_MOVED}" if len(moved) > MAX_MOVED else ""
    title = f"{counted(len(moved), 'track')} whose points moved or slid, as {run.reference} sees them{more}"
    rows = tuple(
        Row(str(row["landmark"]), _numbers(int(row["n"]), row["speed"], row["squared"], row["gain"]))
        for row in moved.head(MAX_MOVED).to_dict("records")
    )
    headings = ("observations", "speed, m/s", "squared residuals", "of these explained")
    return Table(tuple(map(Column, headings)), rows, name="landmark", title=title)


def components_table(estimators: Mapping[str, Mapping[str, Any]]) -> Table:
    """Bias and spread of uL, vL, uR and vR in `estimators` of `summary.json`, of each estimator that has any."""
    components = {name: e.get("components") or {} for name, e in estimators.items()}
    rows = tuple(
        Row(name, _numbers(*((of.get(row) or {}).get(key) for row in ROWS for key in ("bias", "spread"))))
        for name, of in components.items()
        if any(row.get("bias") is not None for row in of.values())
    )
    columns = tuple(Column(title, row, "px") for row in ROWS for title in ("bias", "spread"))
    caption = (
        "Measured minus predicted: mean and standard deviation over all observations of the landmarks that an "
        "estimator has."
    )
    return Table(columns, rows, caption=caption)


def exclusions_table(summary: Mapping[str, Any]) -> Table:
    """How many observations are excluded for each reason by `summary.json`, the most frequent first."""
    counts: Mapping[str, int] = at(summary, "problem", "excluded") or {}
    n = max(1, int(at(summary, "sequence", "observations") or 0))
    rows = tuple(
        Row(REASONS.get(reason, reason), (Cell(number(count)), Cell(per_cent(count / n))))
        for reason, count in sorted(counts.items(), key=lambda item: -item[1])
        if count
    )
    columns = (Column("observations"), Column("of all"))
    caption = "Decided once for all estimators, before any of them runs."
    return Table(columns, rows, name="an observation takes no part because", caption=caption)


def events_tables(run: Run) -> list[Table]:
    """Events of each estimator, the first so many; estimators that one run answers for share a table."""
    names: dict[int, list[str]] = {}
    estimates: dict[int, Estimate] = {}
    for name, result in run.results.items():
        if result.estimate.events:
            names.setdefault(id(result.estimate.events), []).append(name)
            estimates.setdefault(id(result.estimate.events), result.estimate)
    return [_events(names[key], estimate) for key, estimate in estimates.items()]


def _events(names: list[str], estimate: Estimate) -> Table:
    events = estimate.events
    kinds = Counter(event.kind for event in events).most_common()
    title = f"{', '.join(names)}: " + ", ".join(f"{number(count)} × {kind}" for kind, count in kinds)
    rows = tuple(
        Row(str(e.frame), (Cell("" if e.landmark is None else str(e.landmark)), Cell(e.kind), Cell(e.reason)))
        for e in events[:MAX_EVENTS]
    )
    more = len(events) - MAX_EVENTS
    caption = f"and {number(more)} more, which are not listed here." if more > 0 else ""
    columns = (Column("landmark"), Column("what", words=True), Column("why", words=True))
    return Table(columns, rows, name="frame", title=title, caption=caption)


def _frames(
    title: str, tables: Mapping[str, pd.DataFrame], words: Mapping[str, str], figures: Mapping[str, str]
) -> Table:
    """A row for each row of each estimator's table; headings -> its columns of words and of figures."""
    rows = tuple(
        Row(
            name,
            (
                *(Cell(str(row[key])) for key in words.values()),
                *_numbers(*(int(row[key]) if key == "n" else row[key] for key in figures.values())),
            ),
        )
        for name, table in tables.items()
        for row in table.to_dict("records")
    )
    columns = (*(Column(heading, words=True) for heading in words), *map(Column, figures))
    return Table(columns, rows, title=title)


def _numbers(*values: object) -> tuple[Cell, ...]:
    return tuple(Cell(number(value)) for value in values)


def long_tables(run: Run) -> list[Table]:
    """Reprojection in classes, the map by depth and the dynamic landmarks, where a run has them."""
    return [table for table in (_residuals(run), _map(run), _moved(run)) if table.rows]
