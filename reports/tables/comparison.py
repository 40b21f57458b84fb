"""The tables of a comparison: as pandas, and as text in the forms that papers and pages want."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ..formatting import number
from .comparison import Comparison
from .summary import summarise

Path = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Column:
    """A figure of `comparison.json`, and how it stands in the table."""

    group: str
    heading: str
    path: Path
    """of keys under `estimates.NAME`"""
    compared: bool = True
    """whether the smallest is the best"""
    same_data: bool = False
    """whether it is taken over the same moments or observations for all, whatever each one covers"""

    @property
    def title(self) -> str:
        """Group and heading in one."""
        return f"{self.group}: {self.heading}"


@dataclass(frozen=True, slots=True)
class Value:
    """A figure with its interval, where it has one."""

    value: float
    low: float
    high: float

    @property
    def text(self) -> str:
        """`0.52 [0.41, 0.66]`, or a dash."""
        if not (np.isfinite(self.low) and np.isfinite(self.high)):
            return number(self.value)
        return f"{number(self.value)} [{number(self.low)}, {number(self.high)}]"


ABSENT = Value(float("nan"), float("nan"), float("nan"))


def columns(comparison: Comparison) -> list[Column]:
    """The columns that some estimate has a value for."""
    ranking = comparison.ranking
    every = [
        Column("coverage", "share of the reference's time", ("coverage",), compared=False),
        Column("absolute error", "RMSE, m", ("translation", "rmse")),
    ]
    if not ranking.same and ranking.moments:
        every.append(Column("absolute error", "RMSE over common moments, m", ("common", "rmse"), same_data=True))
    every += [
        Column("absolute error", "RMSE above the nearest's, m", ("behind",), compared=False),
        Column("absolute error", "largest, m", ("translation", "max")),
        Column("absolute error", "rotation RMSE, °", ("rotation_deg", "rmse")),
    ]
    for delta in comparison.deltas:
        group = f"error of motion over {delta}"
        every += [
            Column(group, "RMSE, m", ("relative", delta, "translation", "rmse")),
            Column(group, "rotation RMSE, °", ("relative", delta, "rotation_deg", "rmse")),
        ]
    found = [r.segments for r in comparison.results.values() if r.segments is not None]
    segments = "KITTI segments" if all(s.official for s in found) else "segments (KITTI's way, lengths fitted)"
    every += [
        Column("consistency", "NEES, mean (6 expected)", ("nees", "mean"), compared=False),
        Column("drift", "%", ("drift", "translation")),
        Column("drift", "°/m", ("drift", "rotation")),
        Column(segments, "%", ("segments", "intervals", "translation_percent")),
        Column(segments, "°/m", ("segments", "intervals", "rotation_deg_per_m")),
        Column("reprojection, median px", "its landmarks", ("reprojection", "median")),
        Column("reprojection, median px", "of common", ("reprojection_common", "median"), same_data=True),
        Column("reprojection, median px", "triangulated", ("reprojection_along", "median")),
        Column("map, median distance of landmarks", "in the world, m", ("map", "median")),
        Column("map, median distance of landmarks", "as seen, m", ("map", "median_seen")),
        Column("held-out tracks", "median, px", ("held_out", "median"), same_data=True),
    ]
    known = values(comparison)
    return [c for c in every if any(np.isfinite(value_at(e, c.path).value) for e in known.values())]


def values(comparison: Comparison) -> dict[str, Mapping[str, Any]]:
    """`comparison.json` by name: the reference's part too, under its own."""
    summary = summarise(comparison).model_dump(mode="json", by_alias=True)
    return {comparison.reference.name: summary["reference"], **summary["estimates"]}


def value_at(estimate: Mapping[str, Any], path: Path) -> Value:
    """The figure at a path of keys; ABSENT where there is none."""
    value: Any = estimate
    for key in path:
        value = value.get(key) if isinstance(value, Mapping) else None
    if isinstance(value, Mapping):
        return Value(*(_float(value.get(key)) for key in ("value", "low", "high")))
    return Value(_float(value), float("nan"), float("nan"))


def main_table(comparison: Comparison) -> pd.DataFrame:
    """One row per estimate: the figures, and behind each that has an interval its `low` and `high`."""
    known = values(comparison)
    table: dict[str, list[float]] = {}
    for column in columns(comparison):
        cells = [value_at(known[name], column.path) for name in comparison.results]
        table[column.title] = [cell.value for cell in cells]
        if any(np.isfinite(cell.low) for cell in cells):
            table[f"{column.title}, low"] = [cell.low for cell in cells]
            table[f"{column.title}, high"] = [cell.high for cell in cells]
    return pd.DataFrame(table, index=pd.Index(comparison.results, name="estimate"))


def metrics_table(comparison: Comparison) -> pd.DataFrame:
    """`metrics.csv`: estimate, metric (its path in comparison.json), value, low, high."""
    known = values(comparison)
    rows = [
        (name, metric, value.value, value.low, value.high)
        for name in comparison.results
        for metric, value in _leaves(known[name])
    ]
    return pd.DataFrame(rows, columns=["estimate", "metric", "value", "low", "high"])


@dataclass(frozen=True, slots=True)
class Line:
    """A figure of every trajectory of the table, as people read it."""

    group: str
    heading: str
    cells: list[str]
    best: list[bool]
    """which of them are the best, where there are several"""

    @property
    def title(self) -> str:
        """Group and heading in one."""
        return f"{self.group}: {self.heading}"


def text_table(comparison: Comparison) -> tuple[list[str], list[Line]]:
    """Names, a column each, and a line for every figure; the reference is among them where it has something to show."""
    known, chosen = values(comparison), columns(comparison)
    reference = comparison.reference.name
    names = list(comparison.results)
    rivals = [name for name, result in comparison.results.items() if not result.entry.by_product]
    if any(np.isfinite(value_at(known[reference], c.path).value) for c in chosen):
        names.insert(0, reference)
    lines = []
    for column in chosen:
        cells = [value_at(known[name], column.path) for name in names]
        others = [c.value for n, c in zip(names, cells, strict=True) if n in rivals and np.isfinite(c.value)]
        compared = column.compared and (column.same_data or comparison.ranking.same)
        text = number(min(others)) if compared and len(others) > 1 else None
        best = [n in rivals and number(c.value) == text for n, c in zip(names, cells, strict=True)]
        lines.append(Line(column.group, column.heading, [c.text for c in cells], best))
    return names, lines


def _leaves(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Value]]:
    for key, inner in tree.items():
        path = f"{above}.{key}" if above else key
        if isinstance(inner, Mapping) and {"value", "low", "high"} <= inner.keys():
            yield path, Value(*(_float(inner[k]) for k in ("value", "low", "high")))
        elif isinstance(inner, Mapping):
            yield from _leaves(inner, path)
        elif isinstance(inner, int | float) and not isinstance(inner, bool):
            yield path, Value(float(inner), float("nan"), float("nan"))


def _float(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")
