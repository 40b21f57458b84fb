"""Tables of a comparison: the one that people read, and those of table.csv and metrics.csv."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline.compare.limits import Better
from fgbaseline.compare.trajectory_comparison.comparison import Comparison

from ..results.comparison import Summary
from .table import Column, Row, Table, Value, compared

LOWER = Better.LOWER


def comparison_table(comparison: Comparison, summary: Summary, *, mark_reference: bool = False) -> Table:
    """A row for each figure, a column for each trajectory: the reference is one of them where it has a figure."""
    results, reference = summary.by_name, comparison.reference.name
    columns = _columns(comparison, results)
    rivals = [name for name, result in comparison.results.items() if not result.entry.by_product]
    names = list(comparison.results)
    if any(column.value(results[reference]) for column in columns):
        names.insert(0, reference)
    cells = []
    for column in columns:
        ranked = column if column.same_data or comparison.ranking.same else replace(column, better=Better.NEITHER)
        cells.append(compared(ranked, {name: column.value(results[name]) for name in names}, rivals))
    rows = tuple(
        Row(name, tuple(of[name] for of in cells), reference=mark_reference and name == reference) for name in names
    )
    return Table(columns, rows, caption=summary.caption).transposed()


def main_table(comparison: Comparison, summary: Summary) -> pd.DataFrame:
    """One row per estimate: the figures, and behind each that has an interval its `low` and `high`."""
    results = summary.by_name
    table: dict[str, list[float]] = {}
    for column in _columns(comparison, results):
        values = [column.value(results[name]) for name in comparison.results]
        table[column.full_title] = [value.value for value in values]
        if any(np.isfinite(value.low) for value in values):
            table[f"{column.full_title}, low"] = [value.low for value in values]
            table[f"{column.full_title}, high"] = [value.high for value in values]
    return pd.DataFrame(table, index=pd.Index(comparison.results, name="estimate"))


def metrics_table(summary: Summary) -> pd.DataFrame:
    """`metrics.csv`: estimate, metric (its path in comparison.json), value, low, high."""
    results = summary.by_name
    rows = [(name, metric, *value) for name in summary.estimates for metric, value in _figures(results[name])]
    return pd.DataFrame(rows, columns=["estimate", "metric", *Value._fields])


def _columns(comparison: Comparison, results: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns for which some trajectory has a figure."""
    found = [result.segments for result in comparison.results.values() if result.segments is not None]
    segments = "KITTI segments" if all(s.official for s in found) else "segments (KITTI's way, lengths fitted)"
    absolute, reprojection, landmarks = "absolute error", "reprojection, median px", "map, median distance of landmarks"
    every = (
        Column("share of the reference's time", "coverage", path=("coverage",)),
        Column("RMSE", absolute, "m", ("translation", "rmse"), LOWER),
        Column("RMSE over common moments", absolute, "m", ("common", "rmse"), LOWER, same_data=True),
        Column("RMSE above the nearest's", absolute, "m", ("behind",)),
        Column("largest", absolute, "m", ("translation", "max"), LOWER),
        Column("rotation RMSE", absolute, "°", ("rotation_deg", "rmse"), LOWER),
        *(
            Column(title, f"error of motion over {delta}", unit, ("relative", delta, key, "rmse"), LOWER)
            for delta in comparison.deltas
            for title, unit, key in (("RMSE", "m", "translation"), ("rotation RMSE", "°", "rotation_deg"))
        ),
        Column("NEES, mean (6 expected)", "consistency", path=("nees", "mean")),
        Column("%", "drift", path=("drift", "translation"), better=LOWER),
        Column("°/m", "drift", path=("drift", "rotation"), better=LOWER),
        Column("%", segments, path=("segments", "intervals", "translation_percent"), better=LOWER),
        Column("°/m", segments, path=("segments", "intervals", "rotation_deg_per_m"), better=LOWER),
        Column("its landmarks", reprojection, path=("reprojection", "median"), better=LOWER),
        Column("of common", reprojection, path=("reprojection_common", "median"), better=LOWER, same_data=True),
        Column("triangulated", reprojection, path=("reprojection_along", "median"), better=LOWER),
        Column("in the world", landmarks, "m", ("map", "median"), LOWER),
        Column("as seen", landmarks, "m", ("map", "median_seen"), LOWER),
        Column("median", "held-out tracks", "px", ("held_out", "median"), LOWER, same_data=True),
    )
    return tuple(
        column
        for column in every
        if any(column.value(of) for of in results.values())
        and not (column.path[0] == "common" and comparison.ranking.same)
    )


def _figures(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Value]]:
    """Paths of the numbers, and of the figures with an interval."""
    for key, inner in tree.items():
        path = f"{above}.{key}" if above else key
        if isinstance(inner, Mapping) and not {*Value._fields} <= inner.keys():
            yield from _figures(inner, path)
        elif isinstance(inner, Mapping | int | float) and not isinstance(inner, bool):
            yield path, Column(key, path=(key,)).value(tree)
