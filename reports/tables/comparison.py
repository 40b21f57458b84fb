"""Tables of a comparison: for page and terminal, and for table.csv and metrics.csv."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fgbaseline.compare.acceptance_limits import Better
from fgbaseline.compare.trajectory_comparison.comparison import Comparison

from ..formatting import resolution, resolved
from ..results.glossary import MAP, SEGMENTS
from ..results.metric_record import COMPARISON, Metric, Value, value_at
from ..results.metric_registry import over_deltas, shown_in
from .table import Cell, Column, Row, Table, mark_best

if TYPE_CHECKING:
    import pandas as pd

Results = Mapping[str, Mapping[str, Any]]
"""values of the reference and of every estimate, as JSON has them: see `comparison_summary.results_by_name`"""


def comparison_table(comparison: Comparison, results: Results, caption: str, *, mark_reference: bool = False) -> Table:
    """A row for each metric, a column for each trajectory: the reference is one of them where it has a value."""
    reference = comparison.reference.name
    metrics = _metrics(comparison, results)
    rivals = [name for name, result in comparison.results.items() if not result.entry.by_product]
    names = list(comparison.results)
    if any(m.value(results[reference]) for m in metrics):
        names.insert(0, reference)
    cells = []
    for m in metrics:
        better = m.better if m.same_data or comparison.ranking.same else Better.NEITHER
        values = {name: m.value(results[name]) for name in names}
        cells.append(mark_best(better, values, rivals) | _unresolved(comparison, m, values))
    rows = tuple(
        Row(name, tuple(of[name] for of in cells), reference=mark_reference and name == reference) for name in names
    )
    return Table(tuple(map(Column.of, metrics)), rows, caption=caption).transposed()


def _unresolved(comparison: Comparison, metric: Metric, values: Mapping[str, Value]) -> dict[str, Cell]:
    """Cells of the distances, angles and rates that are below the resolution: 0, and never the best."""
    found = {}
    for name, result in comparison.results.items():
        step = resolution({} if metric.group == MAP else result.resolution, metric.unit)
        if abs(values[name].value) < step:
            found[name] = Cell(resolved(values[name].value, step))
    return found


def main_columns(comparison: Comparison, results: Results) -> dict[str, list[Any]]:
    """Columns of `table.csv`, one row per estimate: the values, and after each with an interval `low` and `high`."""
    table: dict[str, list[Any]] = {"estimate": list(comparison.results)}
    for m in _metrics(comparison, results):
        values = [m.value(results[name]) for name in comparison.results]
        table[m.full_title] = [value.value for value in values]
        if any(np.isfinite(value.low) for value in values):
            table[f"{m.full_title}, low"] = [value.low for value in values]
            table[f"{m.full_title}, high"] = [value.high for value in values]
    return table


def main_frame(comparison: Comparison, results: Results) -> "pd.DataFrame":
    """The values of `main_columns` without their intervals: one metric a row, one estimate a column."""
    import pandas as pd

    metrics = _metrics(comparison, results)
    rows = [[m.value(results[name]).value for name in comparison.results] for m in metrics]
    return pd.DataFrame(rows, pd.Index([m.full_title for m in metrics], name="metric"), list(comparison.results))


def metrics_columns(comparison: Comparison, results: Results) -> dict[str, list[Any]]:
    """Columns of `metrics.csv`: estimate, metric (its path in comparison.json), value, low, high."""
    rows = [(name, metric, *value) for name in comparison.results for metric, value in _figures(results[name])]
    names = "estimate", "metric", *Value._fields
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def _metrics(comparison: Comparison, results: Mapping[str, Any]) -> list[Metric]:
    """Metrics of which some trajectory has a value."""
    found = [result.segments for result in comparison.results.values() if result.segments is not None]
    fitted = "" if all(s.official for s in found) else f"{SEGMENTS} (lengths other than KITTI's)"
    return [
        replace(m, group=fitted, term=SEGMENTS) if fitted and m.group == SEGMENTS else m
        for m in over_deltas(shown_in(COMPARISON), comparison.deltas)
        if any(m.value(of) for of in results.values()) and not (m.path[0] == "common" and comparison.ranking.same)
    ]


def _figures(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Value]]:
    """Paths of the numbers, and of the values with an interval."""
    for key, inner in tree.items():
        path = f"{above}.{key}" if above else key
        if isinstance(inner, Mapping) and not {*Value._fields} <= inner.keys():
            yield from _figures(inner, path)
        elif isinstance(inner, Mapping | int | float) and not isinstance(inner, bool):
            yield path, value_at(tree, key)
