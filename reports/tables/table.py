"""The table of every report: columns with group, unit and direction, rows with cells, notes and a caption."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import groupby
from math import isfinite, nan
from typing import Any, NamedTuple

from fgbaseline.compare.limits import Better

from ..formatting import interval
from ..results.tree import at


class Value(NamedTuple):
    """A figure, and its 95 % interval where it has one; NaN for what is missing."""

    value: float
    low: float = nan
    high: float = nan

    @property
    def text(self) -> str:
        """`0.52 [0.41, 0.66]`, the value alone, or a dash."""
        return interval(self.value, self.low, self.high)

    def __bool__(self) -> bool:
        """Whether there is a finite figure."""
        return isfinite(self.value)


@dataclass(frozen=True, slots=True)
class Column:
    """A column, or a figure of nested results and how it stands in a table."""

    title: str
    group: str = ""
    unit: str = ""
    path: tuple[str, ...] = ()
    """of keys below an estimator's or estimate's results"""
    better: Better = Better.NEITHER
    scale: float = 1.0
    words: bool = False
    """whether its cells are words, which are aligned to the left"""
    absent: str = ""
    """why its figure may be missing, where the results do not say"""
    same_data: bool = False
    """whether it is taken over the same data for all, so that it says which is best whatever each one covers"""

    @property
    def heading(self) -> str:
        """Title and unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    @property
    def full_title(self) -> str:
        """Group, title and unit."""
        return f"{self.group}: {self.heading}" if self.group else self.heading

    def value(self, results: Mapping[str, Any]) -> Value:
        """Its figure in the results of one estimator: a number, or a mapping with `value`, `low` and `high`."""
        found = at(results, *self.path)
        parts = [found.get(key) for key in Value._fields] if isinstance(found, Mapping) else [found]
        return Value(*(self.scale * _float(part) for part in parts))


class Cell(NamedTuple):
    """A figure as text, whether it is the best of its column, and the mark of the note on it."""

    text: str
    best: bool = False
    note: str = ""


@dataclass(frozen=True, slots=True)
class Row:
    """What a row is about, and its cells; in place of cells the reason why there are none."""

    name: str
    cells: tuple[Cell, ...]
    group: str = ""
    """rows of one group stand together under its title"""
    reason: str = ""
    status: str = "ok"
    reference: bool = False
    link: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """What writers and the HTML macro lay out."""

    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    name: str = "estimator"
    """heading of the rows' names"""
    caption: str = ""
    notes: tuple[tuple[str, str], ...] = ()
    """mark and text"""
    title: str = ""

    @property
    def groups(self) -> list[tuple[str, int]]:
        """The title of each group of columns, and how many it spans; empty where no column has one."""
        spans = [(group, len(list(same))) for group, same in groupby(column.group for column in self.columns)]
        return spans if any(group for group, _ in spans) else []

    @property
    def opens(self) -> list[bool]:
        """For each column whether it is the first of a group other than the first."""
        return [i > 0 and self.columns[i - 1].group != c.group for i, c in enumerate(self.columns)]

    @property
    def by_group(self) -> Iterator[tuple[str, list[Row]]]:
        """The rows of each group."""
        return ((group, list(rows)) for group, rows in groupby(self.rows, key=lambda row: row.group))

    def transposed(self, name: str = "") -> "Table":
        """A row for each column, under the titles of their groups, and a column for each row."""
        columns = tuple(Column(f"{row.name} (reference)" if row.reference else row.name) for row in self.rows)
        rows = tuple(
            Row(column.heading, tuple(row.cells[i] for row in self.rows), group=column.group)
            for i, column in enumerate(self.columns)
        )
        return replace(self, columns=columns, rows=rows, name=name)


def compared(column: Column, values: Mapping[str, Value], rivals: Collection[str]) -> dict[str, Cell]:
    """The cells of a column by name; the best among the rivals are marked, figures that read the same together."""
    first = best(column, {name: value.value for name, value in values.items() if name in rivals})
    text = None if first is None else interval(first, nan, nan)
    return {
        name: Cell(value.text, best=name in rivals and interval(value.value, nan, nan) == text)
        for name, value in values.items()
    }


def best(column: Column, values: Mapping[str, float]) -> float | None:
    """The best of the finite values; None without a direction, and where fewer than two are known."""
    known = [value for value in values.values() if isfinite(value)]
    if column.better is Better.NEITHER or len(known) < 2:
        return None
    return min(known) if column.better is Better.LOWER else max(known)


def _float(value: object) -> float:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else nan
