"""The tables of a bench: every case by estimator, rankings, mean ranks over cases, and the runs."""

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from fgbaseline.compare.acceptance_limits import Better

from ..formatting import counted, interval, number
from ..results.bench import BENCH_METRICS, Results, cases, consistency, costs, overall, rankings, records
from ..results.glossary import ATE, DIVERGENCE, HELD_OUT, NEES
from ..results.metric_record import BENCH, Value
from ..results.metric_registry import shown_in
from .table import Cell, Column, Row, Table, mark_best, numbers, words

Key: TypeAlias = tuple[str, str]
"""case and estimator"""
Rows: TypeAlias = Mapping[Key, Mapping[str, Any]]
WITH_INTERVAL = (ATE, HELD_OUT, DIVERGENCE)
ANEES = {"overconfident": " ↑", "conservative": " ↓"}
COSTS = {
    "seconds": (Column("time", unit="s"), Better.LOWER),
    "memory_mb": (Column("peak memory", unit="MB"), Better.NEITHER),
}


def main_table(results: Results, *, with_costs: bool, caption: str = "") -> Table:
    """Every case by estimator; costs, which differ from time to time, stand in it only where asked for."""
    table = _by_key(cases(results))
    columns = [*_metrics(table), *_anees(results), *(_costs(results) if with_costs else ())]
    if any(row["failed"] for row in table.values()):
        answered = {key: Cell(f"{row['runs'] - row['failed']} of {row['runs']}") for key, row in table.items()}
        columns.append((Column("answered"), answered))
    missing, references, rows = Cell(number(None)), results.references, []
    for key, row in table.items():
        case, name = key
        failed = row["failed"] == row["runs"]
        shown = () if failed else tuple(cells.get(key, missing) for _, cells in columns)
        reason = f"failed: {_reason(results, key)}" if failed else ""
        rows.append(Row(name, shown, group=case, reason=reason, reference=references.get(case) == name))
    return Table(tuple(column for column, _ in columns), tuple(rows), caption=caption)


def _metrics(table: Rows) -> Iterator[tuple[Column, dict[Key, Cell]]]:
    known = next(iter(table.values()))
    for metric in shown_in(BENCH):
        if metric.name not in known:
            continue
        sides = [f"{metric.name}{side}" for side in ("_low", "_high")] if metric.group in WITH_INTERVAL else []
        names = [metric.name, *sides]
        values = {key: Value(*(metric.scale * row.get(name, np.nan) for name in names)) for key, row in table.items()}
        yield Column.flat(metric), _cells(metric.better, values, above_zero=metric.group == DIVERGENCE)


def _anees(results: Results) -> Iterator[tuple[Column, dict[Key, Cell]]]:
    judged = _by_key(consistency(results))
    if judged:
        yield (
            Column("ANEES", term=NEES),
            {key: Cell(number(row["anees"]) + ANEES.get(row["verdict"], "")) for key, row in judged.items()},
        )


def _costs(results: Results) -> Iterator[tuple[Column, dict[Key, Cell]]]:
    spent = _by_key(costs(results))
    for name, (column, better) in COSTS.items():
        values = {key: Value(float(row[name])) for key, row in spent.items()}
        if any(values.values()):
            yield column, _cells(better, values)


def _cells(better: Better, values: Mapping[Key, Value], *, above_zero: bool = False) -> dict[Key, Cell]:
    """The cells, the best of each case marked unless all are alike; with `above_zero` the reference is no rival."""
    cells: dict[Key, Cell] = {}
    for case in dict.fromkeys(case for case, _ in values):
        own = {name: value for (other, name), value in values.items() if other == case}
        rivals = [name for name, value in own.items() if value and (value.value > 0.0 or not above_zero)]
        alike = len({own[name].value for name in rivals}) < 2
        cells |= {(case, name): cell for name, cell in mark_best(better, own, () if alike else rivals).items()}
    return cells


def ranking_tables(results: Results) -> Iterator[Table]:
    """A ranking for each metric of accuracy, and the mean ranks over all cases."""
    ranked = records(rankings(results))
    for metric in BENCH_METRICS:
        rows = tuple(_ranked(row) for row in ranked if row["metric"] == metric.name)
        if rows:
            names = (*numbers("rank"), *words("estimator"), *numbers("runs"))
            columns = (*names, Column.flat(metric), *numbers("above the first"), *words(""))
            yield Table(columns, rows, name="case", title=f"Ranked by {metric.heading}")
    headings = {metric.name: metric.heading for metric in BENCH_METRICS}
    rows = tuple(
        Row.of(
            row["estimator"],
            headings[row["metric"]],
            str(row["cases"]),
            interval(row["mean_rank"], row["low"], row["high"]),
            str(row["first"]),
        )
        for row in records(overall(results))
    )
    if rows:
        yield Table((*words("by"), *numbers("cases", "mean rank", "first in")), rows, title="Over all cases")


def _ranked(row: Mapping[str, Any]) -> Row:
    first = row["rank"] == 1
    behind = "" if first else interval(row["behind"], row["behind_low"], row["behind_high"])
    tied = "not separated from it" if row["tied"] and not first else ""
    mean = interval(row["mean"], row["low"], row["high"])
    return Row.of(row["case"], str(row["rank"]), row["estimator"], str(row["runs"]), mean, behind, tied)


def runs_table(results: Results, pages: str) -> Table:
    """Each run with its page below the folder `pages`, the trust in its reference, and the reason of a failure."""
    by_run: Mapping[Any, pd.DataFrame] = dict(list(results.runs.groupby("run")))
    rows = []
    for one in results.planned:
        frame = by_run[one.name]
        first, failure = frame.iloc[0], results.failures.get(one.name, "")
        if failure:
            rows.append(Row.of(one.name, "", "", failure))
            continue
        failed = records(frame[frame["status"] == "failed"])
        size = f"{counted(int(first['frames']), 'frame')}, {counted(int(first['observations']), 'observation')}"
        reasons = "; ".join(f"{row['estimator']} failed: {row['reason']}" for row in failed)
        link = "" if one.job.page == "none" else f"{pages}/{one.job.key}/report.html"
        rows.append(Row.of(one.name, size, f"{first['reference']} {first['trust']}", reasons, link=link))
    columns = (*numbers("size"), *words("reference", "failures"))
    return Table(columns, tuple(rows), name="run", title=counted(len(rows), "run"))


def _by_key(table: pd.DataFrame) -> dict[Key, dict[str, Any]]:
    return {(row["case"], row["estimator"]): row for row in records(table)}


def _reason(results: Results, key: Key) -> str:
    runs = results.runs
    return str(runs[(runs["case"] == key[0]) & (runs["estimator"] == key[1])]["reason"].iloc[0])
