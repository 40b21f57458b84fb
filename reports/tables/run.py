"""Tables of a run: main figures, evidence, details that the page folds away, the terminal's, and metrics.csv."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import islice
from math import isfinite, isnan, nan
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline.compare import Criterion
from fgbaseline.compare.estimate_comparison import Run, same_frames
from fgbaseline.compare.reference_trust import SHARE
from fgbaseline.data import Estimate, Event
from fgbaseline.data.finding import Finding

from ..formatting import DASH, INFINITY, RESOLUTION, counted, listed, number, per_cent, quantity, resolved
from ..results.json_tree import INFINITE, at, leaves
from ..results.metric import ATE, DIVERGENCE, EVIDENCE, MAIN, MAP, TERMINAL, Metric
from ..results.metrics import ate_resolution, shown_in
from ..results.reader import DIVERGENCES
from ..results.run import Summary
from .table import Cell, Column, Row, Table, best

PIXEL_ROWS = ("uL", "vL", "uR", "vR")
OVERCONFIDENT = "overconfident"
"""in place of a reference NEES, for which P - P_ref has to be positive definite"""
NOT_POSITIVE_DEFINITE = (
    "in most frames P - P_ref is not positive definite: the claimed covariance is below the reference's"
)
NOT_DEFINED = "P - P_ref is not positive definite in the others"
MAX_DYNAMIC = 100
MAX_EVENTS = 200
"""kinds of events of an estimator, with their causes, that are listed"""
REASONS: Mapping[str, str] = {
    "feature not chosen": "not among the features asked for",
    "disparity": "disparity too small to determine the depth",
    "rows": "rows in the left and right image disagree",
    "prediction": "contradicts its own track under the motion",
    "short": "rest of the track too short for a check",
    "geometry": "point not determined, or behind a camera",
    "moving": "point moved",
    "copied": "copied from the previous frame",
}
"""why the mask excludes an observation"""
Estimators = Mapping[str, Mapping[str, Any]]


def main_table(run: Run, estimators: Estimators) -> Table:
    """Every estimator's main figures from `estimators` of `summary.json`; figures that no estimator has are left out.

    Estimates from the reference's own run or graph are close to it by construction and are not called best.
    """
    table = _table(run, estimators, shown_in(MAIN))
    if not table.columns:
        return table
    caption = (
        f"Best of a column in bold; equal printed values are all bold.{_unranked(run)} Reprojection errors "
        "are over all observations of the landmarks that an estimator has; common observations are those that every "
        "estimator with landmark updates used."
    )
    return replace(table, caption=caption)


def _unranked(run: Run) -> str:
    """Sentence on the estimators that are not ranked by divergence; empty without a reference."""
    if run.reference is None:
        return ""
    reasons = {
        **dict.fromkeys(sorted(run.added), "aligned"),
        **dict.fromkeys(sorted(run.same_graph), "same graph"),
        **dict.fromkeys(sorted(run.by_products), "its causal estimate"),
    }
    each = [f"{name} ({why})" for name, why in reasons.items() if name in run.results]
    return f" Not ranked by divergence: {listed([f'{run.reference} (the reference)', *each])}."


def main_values(estimators: Estimators) -> pd.DataFrame:
    """`table.csv`: one row per estimator, its status and the main figures that any of them has."""
    results = {name: e for name, e in estimators.items() if e["status"] != "failed"}
    values = {m.full_title: {name: m.value(e).value for name, e in results.items()} for m in shown_in(MAIN)}
    table = pd.DataFrame(values, index=pd.Index(estimators, name="estimator")).dropna(axis="columns", how="all")
    table.insert(0, "status", [e["status"] for e in estimators.values()])
    return table


def evidence_table(run: Run, estimators: Estimators) -> Table:
    """Held-out tracks, consistency, residuals and map of every estimator that gave an answer."""
    table = _table(run, estimators, shown_in(EVIDENCE))
    return replace(table, rows=tuple(row for row in table.rows if row.cells))


def terminal_table(run: Run, estimators: Estimators) -> Table:
    """The few figures of every estimator that a terminal has room for; those that no estimator has are left out."""
    metrics = [m for m in shown_in(TERMINAL) if any(not isnan(m.value(e).value) for e in estimators.values())]
    if len({e["coverage"] for e in estimators.values()}) == 1:
        metrics = [metric for metric in metrics if not metric.uneven_only]
    rows, resolutions = [], _resolutions(run, metrics)
    for name, e in estimators.items():
        texts = [
            "reference" if m.group == DIVERGENCE and name == run.reference else m.text(m.value(e).value, resolutions[m])
            for m in metrics
        ]
        rows.append(Row(name, tuple(map(Cell, [e["status"], *texts]))))
    return Table((Column("status", words=True), *map(Column.flat, metrics)), tuple(rows))


def _resolutions(run: Run, metrics: Iterable[Metric]) -> dict[Metric, float]:
    """Sizes below which figures are rounding."""
    return {m: ate_resolution(run) if m.group == ATE else RESOLUTION for m in metrics}


def _table(run: Run, estimators: Estimators, metrics: Iterable[Metric]) -> Table:
    values, answered, even = _shown(run, estimators, metrics)
    shown = list(values)
    rivals = {m: _rivals(run, m, answered) if even or m.same_data else set[str]() for m in shown}
    resolutions = _resolutions(run, shown)
    firsts = {m: best(m.better, {name: values[m][name] for name in rivals[m]}) for m in shown}
    notes: dict[str, str] = {}

    def cell(name: str, m: Metric, i: int) -> Cell:
        if m.group == DIVERGENCE and name == run.reference:
            return Cell("reference" if i == 0 or shown[i - 1].group != DIVERGENCE else "")
        value, first = values[m][name], firsts[m]
        why = _left_out(estimators[name], m) if isfinite(value) else _why_absent(estimators[name], m)
        if why == INFINITE:
            return Cell(INFINITY)
        overconfident = _stands_for(run, name, m)
        why = NOT_POSITIVE_DEFINITE if overconfident else why
        mark = notes.setdefault(why, chr(ord("a") + len(notes) % 26)) if why else ""
        if overconfident:
            return Cell(OVERCONFIDENT, note=mark)
        if not isfinite(value):
            return Cell(DASH, note=mark)
        text, is_rounding = m.text(value, resolutions[m]), m.is_rounding(value, resolutions[m])
        return Cell(text, first is not None and text == m.text(first, resolutions[m]) and not is_rounding, mark)

    rows = tuple(
        Row(
            name,
            tuple(cell(name, m, i) for i, m in enumerate(shown)) if name in answered else (),
            reason=result.estimate.reason,
            status=result.estimate.status.value,
            reference=name == run.reference,
        )
        for name, result in run.results.items()
    )
    away = f"divergence from {run.reference}, unaligned"
    columns = tuple(Column.of(m, away if m.group == DIVERGENCE else "") for m in shown)
    return Table(columns, rows, notes=tuple((mark, text) for text, mark in notes.items()))


def _shown(
    run: Run, estimators: Estimators, metrics: Iterable[Metric]
) -> tuple[dict[Metric, dict[str, float]], list[str], bool]:
    """Values of the metrics that a table shows, by estimator that answered, and whether these cover the same frames."""
    answered = [name for name in run.results if name in estimators and run.results[name].answered]
    even = same_frames(np.isfinite(run.results[n].estimate.world_T_imu[:, 0, 0]) for n in answered)

    def is_shown(m: Metric, values: Mapping[str, float]) -> bool:
        if (m.group == DIVERGENCE and len(answered) < 2) or (even and m.uneven_only):
            return False
        return any(
            _stands_for(run, name, m) or (isfinite(value) and (value != 0.0 or not m.nonzero_only))
            for name, value in values.items()
        )

    values = {m: {name: m.value(estimators[name]).value for name in answered} for m in metrics}
    return {m: of_each for m, of_each in values.items() if is_shown(m, of_each)}, answered, even


def main_frame(run: Run, estimators: Estimators) -> pd.DataFrame:
    """The figures of `main_table`, one metric a row and one estimator a column; NaN where there is none."""
    values, _, _ = _shown(run, estimators, shown_in(MAIN))
    rows = [[of_each.get(name, nan) for name in estimators] for of_each in values.values()]
    return pd.DataFrame(rows, pd.Index([m.full_title for m in values], name="metric"), list(estimators))


def trust_table(criteria: Iterable[Criterion]) -> Table:
    """Criteria of the trust in the reference: measured value, limits and verdict."""
    columns = (
        Column("measured"),
        Column("trusted"),
        Column("doubtful"),
        Column("verdict", words=True),
        Column("remark", words=True),
    )
    return Table(columns, tuple(map(_criterion, criteria)), name="criterion")


def _criterion(c: Criterion) -> Row:
    sign = "≥" if c.at_least else "≤"
    text = per_cent if c.unit == SHARE else number
    limits = (f"{sign} {text(c.doubtful)}", f"{sign} {text(c.untrusted)}")
    texts = (text(c.value), *limits, c.verdict.name.lower(), c.remark)
    return Row(f"{c.name}, {c.unit}" if c.unit not in ("", SHARE) else c.name, tuple(map(Cell, texts)))


def _stands_for(run: Run, name: str, metric: Metric) -> bool:
    """Whether OVERCONFIDENT stands for the reference NEES: P is smaller than P_ref in most frames of both."""
    if metric.path not in (("nees_reference", "median"), ("nees_reference", "mean")) or name in run.unranked:
        return False
    difference = run.results[name].evidence.difference
    return difference is not None and difference.is_overconfident


def _rivals(run: Run, metric: Metric, answered: list[str]) -> set[str]:
    is_divergence = metric.group in (DIVERGENCE, MAP) or metric.path[0] in DIVERGENCES
    return set(answered) - ({run.reference, *run.unranked} if is_divergence else set())


def _why_absent(estimator: Mapping[str, Any], metric: Metric) -> str:
    """Reason of a missing value in the summary's notes, by its own key or its parent's."""
    notes: Mapping[str, str] = estimator.get("notes") or {}
    return notes.get(metric.key) or notes.get(metric.path[0]) or metric.absent or "no such figure"


def _left_out(estimator: Mapping[str, Any], metric: Metric) -> str:
    """Errors or frames that a figure leaves out, and why; empty where it leaves out none."""
    if metric.path[0] == "nees_reference":
        frames, left_out = (int(at(estimator, "nees_reference", key) or 0) for key in ("frames", "left_out"))
        if not left_out or metric.path[1] == "left_out":
            return ""
        return f"over {number(frames)} of {counted(frames + left_out, 'frame')}: {NOT_DEFINED}"
    missing = at(estimator, metric.path[0], "missing") or 0
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


def findings_table(findings: Iterable[Finding]) -> Table:
    """Findings of the diagnosis with a measure before and after repair; the status is the certainty, if not counted."""
    rows = tuple(
        Row(
            f.sentence,
            (Cell(f.measure), Cell(quantity(f.before, f.unit)), Cell(quantity(f.after, f.unit))),
            status="ok" if f.certainty == "counted" else f.certainty,
        )
        for f in findings
    )
    columns = (Column("measure", words=True), Column("before repair"), Column("after"))
    return Table(columns, rows, name="finding")


def _residuals(run: Run) -> Table:
    """Reprojection errors in classes."""
    tables = {r.name: r.evidence.patterns for r in run.answered}
    figures = {"n": "n", "median, px": "median", "mean, px": "mean", "95 %, px": "p95"}
    title = "Reprojection errors by distance, track age, place in the image and camera"
    return _frames(title, tables, {"by": "by", "class": "of"}, figures | {"median u, px": "u", "median v, px": "v"})


def _map(run: Run) -> Table:
    """Distances of landmarks from the reference's, by depth."""
    tables = {r.name: table for r in run.answered if (table := r.evidence.map_by_depth) is not None}
    figures = {"landmarks": "n", "distance, m": "distance", "in the camera frame, m": "seen", "sigmas": "sigmas"}
    return _frames("Landmarks beside the reference's, medians by depth", tables, {"depth": "depth"}, figures)


def _moved(run: Run) -> Table:
    """Dynamic landmarks by the reference's residuals, the clearest first; empty without a reference."""
    if run.reference is None:
        return Table((), ())
    table = run.results[run.reference].evidence.moved
    moved = table[table["moved"]].sort_values("gain", ascending=False)
    more = f", the clearest {MAX_DYNAMIC}" if len(moved) > MAX_DYNAMIC else ""
    title = f"{counted(len(moved), 'track')} whose points moved or slid, as {run.reference} sees them{more}"
    rows = tuple(
        Row(str(row["landmark"]), _numbers(int(row["n"]), row["speed"], row["squared"], row["gain"]))
        for row in moved.head(MAX_DYNAMIC).to_dict("records")
    )
    headings = ("observations", "speed, m/s", "chi-square", "of it, explained by a constant velocity")
    return Table(tuple(map(Column, headings)), rows, name="landmark", title=title)


def components_table(estimators: Mapping[str, Mapping[str, Any]]) -> Table:
    """Bias and spread of uL, vL, uR and vR in `estimators` of `summary.json`, robust, of each that has any."""
    components = {name: e.get("components") or {} for name, e in estimators.items()}
    rows = tuple(
        Row(name, _numbers(*((of.get(row) or {}).get(key) for row in PIXEL_ROWS for key in ("bias", "spread"))))
        for name, of in components.items()
        if any(row.get("bias") is not None for row in of.values())
    )
    columns = tuple(Column(title, row, "px") for row in PIXEL_ROWS for title in ("median", "1.4826 MAD"))
    caption = (
        "Measured minus predicted, over all observations of the landmarks that an estimator has. 1.4826 times the "
        "median absolute deviation (MAD) is the sigma of Gaussian residuals; outliers do not change it."
    )
    return Table(columns, rows, caption=caption)


def exclusions_table(summary: Mapping[str, Any]) -> Table:
    """Numbers of observations excluded for each reason in `summary.json`, the most frequent first."""
    counts: Mapping[str, int] = at(summary, "problem", "excluded") or {}
    n = max(1, int(at(summary, "sequence", "observations") or 0))
    rows = tuple(
        Row(REASONS.get(reason, reason), (Cell(number(count)), Cell(per_cent(count / n))))
        for reason, count in sorted(counts.items(), key=lambda item: -item[1])
        if count
    )
    columns = (Column("observations"), Column("of all"))
    caption = "Decided once for all estimators, before any of them runs."
    return Table(columns, rows, name="reason for exclusion", caption=caption)


def events_tables(run: Run) -> list[Table]:
    """Events of each estimator by kind and cause; estimators that one run answers for share a table."""
    names: dict[int, list[str]] = {}
    estimates: dict[int, Estimate] = {}
    for name, result in run.results.items():
        if result.estimate.events:
            names.setdefault(id(result.estimate.events), []).append(name)
            estimates.setdefault(id(result.estimate.events), result.estimate)
    return [_events(names[key], estimate) for key, estimate in estimates.items()]


def _events(names: list[str], estimate: Estimate) -> Table:
    kinds = Counter(event.kind for event in estimate.events).most_common()
    title = f"{', '.join(names)}: " + ", ".join(f"{number(count)} × {kind}" for kind, count in kinds)
    alike: dict[tuple[str, str], list[Event]] = {}
    for event in estimate.events:
        alike.setdefault((event.kind, event.reason), []).append(event)
    rows = tuple(Row(kind, (*_where(events), Cell(why))) for (kind, why), events in islice(alike.items(), MAX_EVENTS))
    more = len(alike) - MAX_EVENTS
    caption = f"{f'And {number(more)} more. ' if more > 0 else ''}tables/events.csv has every event."
    columns = (Column("events"), Column("frames"), Column("landmarks"), Column("why", words=True))
    return Table(columns, rows, name="event", title=title, caption=caption)


def _where(events: list[Event]) -> tuple[Cell, ...]:
    """Number of events of one kind and cause, first and last frame, and the landmark or how many there are."""
    frames = sorted({event.frame for event in events})
    landmarks = sorted({event.landmark for event in events if event.landmark is not None})
    span = f"{frames[0]}" if len(frames) == 1 else f"{frames[0]}–{frames[-1]}"
    few = ", ".join(map(str, landmarks)) if len(landmarks) <= 3 else f"{number(len(landmarks))} of them"
    return Cell(number(len(events))), Cell(span), Cell(few)


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
    """Cells of figures; 0 with the resolution for rounding."""
    return tuple(
        Cell(resolved(v, RESOLUTION) if isinstance(v, float) and 0.0 < abs(v) < RESOLUTION else number(v))
        for v in values
    )


def long_tables(run: Run) -> list[Table]:
    """Reprojection in classes, the map by depth and the dynamic landmarks, where a run has them."""
    return [table for table in (_residuals(run), _map(run), _moved(run)) if table.rows]
