"""Details of a run in tables: trust, findings, residuals, maps, exclusions and events."""

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

import pandas as pd

from fgbaseline.compare import Criterion
from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.compare.reference_trust import SHARE
from fgbaseline.data import Estimate, Event
from fgbaseline.data.finding import Finding

from ..formatting import NO_BREAK, RESOLUTION, counted, grouped, limit_per_cent, number, per_cent, quantity, resolved
from ..results.json_files import at
from .table import Cell, Column, Row, Table, numbers, words

PIXEL_ROWS = ("uL", "vL", "uR", "vR")
MAX_DYNAMIC = 100
MAX_EVENTS = 200
"""kinds of events of an estimator, with their causes, that are listed"""
REASONS: Mapping[str, str] = {
    "feature not chosen": "not among the features asked for",
    "disparity": "disparity too small to determine the depth",
    "rows": "rows in the left and right image disagree",
    "prediction": "contradicts the motion of its track (wrong match)",
    "short": "remaining track too short to check",
    "geometry": "point cannot be triangulated, or is behind a camera",
    "moving": "point moved",
    "copied": "copied from the previous frame",
    "start": "the start was found with it",
}
"""why the mask excludes an observation"""


REPAIR = ("without repair", "with repair and mask")
"""headings of `before` and `after` of findings"""
CONDITIONS: Mapping[str, str] = {
    **dict.fromkeys(
        ("angular_axes", "linear_axes"),
        "Axes: the first value is without any repair of the velocities, the second with that of the axes alone.",
    ),
    **dict.fromkeys(
        ("gyro_bias", "time_offset"),
        "Bias and time offset: all other repairs of the angular velocity are applied to both values.",
    ),
}
"""codes of findings -> sentence on the other repairs that are applied where they are measured"""


def trust_table(criteria: Iterable[Criterion]) -> Table:
    """Criteria of the trust in the reference: measured value, limits and verdict."""
    rows = []
    for c in criteria:
        text, of_limit = (per_cent, limit_per_cent) if c.unit == SHARE else (number, "{:g}".format)
        sign = "≥" if c.at_least else "≤"
        name = f"{c.name}, {c.unit}" if c.unit not in ("", SHARE) else c.name
        limits = (
            f"{'=' if limit == 0.0 and not c.at_least else sign} {of_limit(limit)}"
            for limit in (c.doubtful, c.untrusted)
        )
        rows.append(Row.of(name, text(c.value), *limits, c.verdict.name.lower(), c.remark))
    columns = (*numbers("measured", "trusted if", "doubtful if"), *words("verdict", "remark"))
    return Table(columns, tuple(rows), name="criterion")


def findings_table(findings: Iterable[Finding]) -> Table:
    """Findings of the diagnosis with a measure before and after repair; the status is the certainty, if not counted."""
    rows = []
    for f in findings:
        status = "ok" if f.certainty == "counted" else f.certainty
        rows.append(Row.of(f.sentence, f.measure, quantity(f.before, f.unit), quantity(f.after, f.unit), status=status))
    caption = " ".join(dict.fromkeys(CONDITIONS[f.code] for f in findings if f.code in CONDITIONS))
    return Table((*words("measure"), *numbers(*REPAIR)), tuple(rows), name="fault", caption=caption)


def terminal_findings(findings: Iterable[Finding]) -> Table:
    """Findings by code, the sentence with its certainty as a column, without spaces that a terminal does not break."""
    rows = []
    for f in findings:
        certainty = "" if f.certainty == "counted" else f" ({f.certainty})"
        sizes = (quantity(x, f.unit).replace(NO_BREAK, " ") for x in (f.before, f.after))
        rows.append(Row.of(f.code, f"{f.sentence}{certainty}", f.measure, *sizes))
    columns = (*words("description", "measure"), *numbers(*REPAIR))
    return Table(columns, tuple(rows), name="fault")


def _residuals(run: Run) -> Table:
    """Reprojection errors in classes."""
    tables = {r.name: r.evidence.patterns for r in run.answered}
    columns = {"observations": "n", "median, px": "median", "mean, px": "mean", "95th percentile, px": "p95"}
    title = "Reprojection errors by distance, track age, image region and camera"
    return _frames(
        title,
        tables,
        {"grouped by": "by", "class": "of"},
        columns | {"signed median u, px": "u", "signed median v, px": "v"},
    )


def _map(run: Run) -> Table:
    """Distances of landmarks from the reference's, by depth."""
    tables = {r.name: table for r in run.answered if (table := r.evidence.map_by_depth) is not None}
    columns = {"landmarks": "n", "distance, m": "distance", "in the camera frame, m": "seen", "sigmas": "sigmas"}
    return _frames("Map difference from the reference by depth (medians)", tables, {"depth": "depth"}, columns)


def _moved(run: Run) -> Table:
    """Dynamic landmarks by the reference's residuals, the clearest first; empty without a reference."""
    if run.reference is None:
        return Table((), ())
    table = run.results[run.reference].evidence.moved
    moved = table[table["moved"]].sort_values("gain", ascending=False)
    more = f", the clearest {MAX_DYNAMIC}" if len(moved) > MAX_DYNAMIC else ""
    title = (
        f"{counted(len(moved), 'used track')} that a point of constant velocity fits significantly better than a fixed "
        f"one (residuals of {run.reference}{more})"
    )
    rows = tuple(
        Row(str(row["landmark"]), _numbers(int(row["n"]), row["speed"], row["squared"], row["gain"]))
        for row in moved.head(MAX_DYNAMIC).to_dict("records")
    )
    columns = numbers("observations", "speed, m/s", "chi-square", "drop in chi-square with a constant velocity")
    return Table(columns, rows, name="landmark", title=title)


def components_table(estimators: Mapping[str, Mapping[str, Any]]) -> Table:
    """Bias and spread of uL, vL, uR and vR in `estimators` of `summary.json`, robust, of each that has any."""
    components = {name: e.get("components") or {} for name, e in estimators.items()}
    seen = [r for r in PIXEL_ROWS if any((of.get(r) or {}).get("bias") is not None for of in components.values())]
    rows = tuple(
        Row(name, _numbers(*((of.get(row) or {}).get(key) for row in seen for key in ("bias", "spread"))))
        for name, of in components.items()
        if any(row.get("bias") is not None for row in of.values())
    )
    columns = tuple(Column(title, row, "px") for row in seen or PIXEL_ROWS for title in ("median", "1.4826 MAD"))
    caption = (
        "Measured minus predicted, over all observations of an estimator's landmarks, including those that the mask "
        "excludes. 1.4826 times the median absolute deviation (MAD) is the sigma of Gaussian residuals; a few outliers "
        "hardly change it."
    )
    return Table(columns, rows, caption=caption)


def exclusions_table(summary: Mapping[str, Any]) -> Table:
    """Numbers of observations excluded for each reason in `summary.json`, the most frequent first."""
    counts: Mapping[str, int] = at(summary, "problem", "excluded") or {}
    n = max(1, int(at(summary, "sequence", "observations") or 0))
    rows = tuple(
        Row.of(REASONS.get(reason, reason), number(count), per_cent(count / n))
        for reason, count in sorted(counts.items(), key=lambda item: -item[1])
        if count
    )
    caption = "The mask is the same for all estimators and is made before any of them runs."
    return Table(numbers("observations", "of all"), rows, name="reason for exclusion", caption=caption)


def events_tables(run: Run) -> list[Table]:
    """Events of each estimator by kind and cause; estimators that one run answers for share a table."""
    with_events = [r.estimate for r in run.results.values() if r.estimate.events]
    return [_events(of_one_run) for of_one_run in grouped((id(each.events), each) for each in with_events).values()]


def _events(estimates: list[Estimate]) -> Table:
    events = estimates[0].events
    kinds = [f"{number(count)} × {kind}" for kind, count in Counter(event.kind for event in events).most_common()]
    title = f"{', '.join(estimate.name for estimate in estimates)}: {', '.join(kinds)}"
    alike = grouped(((event.kind, event.reason), event) for event in events)
    rows = tuple(Row.of(kind, *_where(events), why) for (kind, why), events in islice(alike.items(), MAX_EVENTS))
    more = len(alike) - MAX_EVENTS
    caption = f"{f'And {number(more)} more. ' if more > 0 else ''}tables/events.csv has every event."
    columns = (*numbers("events", "frames", "landmarks"), *words("why"))
    return Table(columns, rows, name="event", title=title, caption=caption)


def _where(events: list[Event]) -> tuple[str, str, str]:
    """Number of events of one kind and cause, first and last frame, and the landmark or how many there are."""
    frames = sorted({event.frame for event in events})
    landmarks = sorted({event.landmark for event in events if event.landmark is not None})
    span = f"{frames[0]}" if len(frames) == 1 else f"{frames[0]}–{frames[-1]}"
    few = f"no. {', '.join(map(str, landmarks))}" if landmarks else ""
    return number(len(events)), span, few if len(landmarks) <= 3 else counted(len(landmarks), "landmark")


def _frames(
    title: str, tables: Mapping[str, pd.DataFrame], classes: Mapping[str, str], sizes: Mapping[str, str]
) -> Table:
    """A row for each row of each estimator's table; headings -> its columns of words and of values."""
    rows = []
    for name, table in tables.items():
        for row in table.to_dict("records"):
            cells = _numbers(*(int(row[key]) if key == "n" else row[key] for key in sizes.values()))
            rows.append(Row(name, (*(Cell(str(row[key])) for key in classes.values()), *cells)))
    return Table((*words(*classes), *numbers(*sizes)), tuple(rows), title=title)


def _numbers(*values: object) -> tuple[Cell, ...]:
    """Cells of values; 0 with the resolution for rounding."""
    return tuple(
        Cell(resolved(v, RESOLUTION) if isinstance(v, float) and 0.0 < abs(v) < RESOLUTION else number(v))
        for v in values
    )


def long_tables(run: Run) -> list[Table]:
    """Reprojection in classes, the map by depth and the dynamic landmarks, where a run has them."""
    return [table for table in (_residuals(run), _map(run), _moved(run)) if table.rows]
