"""Tables of a run: main values and evidence of each estimator, the terminal's, and metrics.csv."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import isfinite, isnan, nan
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline.compare.estimate_comparison import Run, same_frames

from ..formatting import DASH, INFINITY, RESOLUTION, counted, listed, number
from ..results.glossary import ATE, DIVERGENCE, MAP
from ..results.json_files import INFINITE, at, leaves
from ..results.metric_record import EVIDENCE, MAIN, TERMINAL, Metric
from ..results.metric_registry import ate_resolution, shown_in
from ..results.reader import DIVERGENCES
from ..results.run import Summary
from .table import Cell, Column, Row, Table, best

OVERCONFIDENT = "overconfident"
"""in place of a reference NEES, for which P - P_ref has to be positive definite"""
NOT_POSITIVE_DEFINITE = (
    "in most frames P_ref exceeds 1.1 P in some direction, although the reference uses at least the same data (P: "
    "covariance of the estimator; P_ref: of the reference)"
)
DEFINED = "P − P_ref is positive definite"
Estimators = Mapping[str, Mapping[str, Any]]


def main_table(run: Run, estimators: Estimators) -> Table:
    """Every estimator's main values from `estimators` of `summary.json`; values that no estimator has are left out.

    Estimates from the reference's own run or graph are close to it by construction and are not called best.
    """
    table = _table(run, estimators, shown_in(MAIN))
    if not table.columns:
        return table
    caption = (
        f"Best of a column in bold; equal printed values are all bold.{_unranked(run)} Reprojection errors are "
        "over all observations of an estimator's landmarks, including those that the mask excludes as copied or wrong. "
        "Common observations are those that every estimator with landmark updates used."
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
    """`table.csv`: one row per estimator, its status and the main values that any of them has."""
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
    """The few values of every estimator that a terminal has room for; those that no estimator has are left out."""
    metrics = [m for m in shown_in(TERMINAL) if any(not isnan(m.value(e).value) for e in estimators.values())]
    if len({e["coverage"] for e in estimators.values()}) == 1:
        metrics = [metric for metric in metrics if not metric.uneven_only]
    rows, resolutions = [], _resolutions(run, metrics)
    for name, e in estimators.items():
        texts = [
            "reference" if m.group == DIVERGENCE and name == run.reference else m.text(m.value(e).value, resolutions[m])
            for m in metrics
        ]
        rows.append(Row.of(name, e["status"], *texts))
    return Table((Column("status", words=True), *map(Column.flat, metrics)), tuple(rows))


def _resolutions(run: Run, metrics: Iterable[Metric]) -> dict[Metric, float]:
    """Sizes below which values are rounding."""
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
        if not isfinite(value) or _is_of_few_frames(estimators[name], m):
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
    away = f"divergence from {run.reference}"
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
    """The values of `main_table`, one metric a row and one estimator a column; NaN where there is none."""
    values, _, _ = _shown(run, estimators, shown_in(MAIN))
    rows = [[of_each.get(name, nan) for name in estimators] for of_each in values.values()]
    return pd.DataFrame(rows, pd.Index([m.full_title for m in values], name="metric"), list(estimators))


def _stands_for(run: Run, name: str, metric: Metric) -> bool:
    """Whether OVERCONFIDENT stands for the reference NEES: P is smaller than P_ref in most frames of both."""
    if metric.path not in (("nees_reference", "median"), ("nees_reference", "mean")) or name in run.unranked:
        return False
    difference = run.results[name].evidence.difference
    return difference is not None and difference.is_overconfident


def _is_of_few_frames(estimator: Mapping[str, Any], metric: Metric) -> bool:
    """Whether a reference NEES is defined in less than half of the frames, and does not describe the estimator."""
    if metric.path not in (("nees_reference", "median"), ("nees_reference", "mean")):
        return False
    frames, left_out = (int(at(estimator, "nees_reference", key) or 0) for key in ("frames", "left_out"))
    return frames < left_out


def _rivals(run: Run, metric: Metric, answered: list[str]) -> set[str]:
    is_divergence = metric.group in (DIVERGENCE, MAP) or metric.path[0] in DIVERGENCES
    return set(answered) - ({run.reference, *run.unranked} if is_divergence else set())


def _why_absent(estimator: Mapping[str, Any], metric: Metric) -> str:
    """Reason of a missing value in the summary's notes, by its own key or its parent's."""
    notes: Mapping[str, str] = estimator["notes"]
    return notes.get(metric.key) or notes[metric.path[0]]


def _left_out(estimator: Mapping[str, Any], metric: Metric) -> str:
    """Errors or frames that a value leaves out, and why; empty where it leaves out none."""
    if metric.path[0] == "nees_reference":
        frames, left_out = (int(at(estimator, "nees_reference", key) or 0) for key in ("frames", "left_out"))
        if not left_out or metric.path[1] == "left_out":
            return ""
        those = f"{number(frames)} of {counted(frames + left_out, 'frame')}"
        is_of_few = _is_of_few_frames(estimator, metric)
        return f"{DEFINED} in only {those}" if is_of_few else f"over the {those} in which {DEFINED}"
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
