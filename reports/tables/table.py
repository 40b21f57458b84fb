"""The table of every report; `writers` has its forms."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import groupby
from math import isfinite, nan
from typing import NamedTuple, Self

from fgbaseline.compare.acceptance_limits import Better

from ..formatting import DASH, interval
from ..results.metric_record import Metric, Value


@dataclass(frozen=True, slots=True)
class Column:
    """Heading of a column."""

    title: str
    group: str = ""
    unit: str = ""
    words: bool = False
    """whether its cells are words, which are aligned to the left"""
    term: str = ""
    """term of the glossary"""

    @classmethod
    def of(cls, metric: Metric, group: str = "") -> Self:
        """Column of a metric below its group, or `group`."""
        return cls(metric.title, group or metric.group, metric.unit, term=metric.glossary_term)

    @classmethod
    def flat(cls, metric: Metric) -> Self:
        """Column of a metric under its short title, without a group."""
        return cls(metric.short, "", metric.unit, term=metric.glossary_term)

    @property
    def heading(self) -> str:
        """Title and unit."""
        return f"{self.title}, {self.unit}" if self.unit else self.title


class Cell(NamedTuple):
    """A value as text, whether it is the best of its column, and the mark of the note on it."""

    text: str
    best: bool = False
    note: str = ""


def numbers(*titles: str) -> tuple[Column, ...]:
    """Columns of numbers, aligned to the right."""
    return tuple(map(Column, titles))


def words(*titles: str) -> tuple[Column, ...]:
    """Columns of words, aligned to the left."""
    return tuple(Column(title, words=True) for title in titles)


@dataclass(frozen=True, slots=True)
class Row:
    """Name and cells of a row, or in place of cells the reason why there are none."""

    name: str
    cells: tuple[Cell, ...]
    group: str = ""
    """rows of one group stand together under its title"""
    reason: str = ""
    status: str = "ok"
    reference: bool = False
    link: str = ""
    term: str = ""
    """term of the glossary"""

    @property
    def full_name(self) -> str:
        """Name, with `(reference)` where it is the reference."""
        return f"{self.name} (reference)" if self.reference else self.name

    @classmethod
    def of(cls, name: str, *texts: str, status: str = "ok", link: str = "") -> Self:
        """Row whose cells are texts alone."""
        return cls(name, tuple(map(Cell, texts)), status=status, link=link)


@dataclass(frozen=True, slots=True)
class Table:
    """Table as the writers and the HTML macro lay it out."""

    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    name: str = "estimator"
    """heading of the rows' names"""
    caption: str = ""
    notes: tuple[tuple[str, str], ...] = ()
    """mark and text"""
    title: str = ""

    @property
    def groups(self) -> list[tuple[str, int, str]]:
        """Title of each group of columns, how many it spans, and its term; empty where none has a title."""
        spans = [(group, list(columns)) for group, columns in groupby(self.columns, key=lambda column: column.group)]
        if not any(group for group, _ in spans):
            return []
        shared = {g: len({c.term for c in of}) == 1 and g.startswith(of[0].term) for g, of in spans}
        return [(g, len(of), of[0].term if shared[g] else "") for g, of in spans]

    def own_term(self, column: Column) -> str:
        """Term that the heading of a column links to; empty where that of its group does."""
        return "" if column.group and any(g == column.group and term for g, _, term in self.groups) else column.term

    @property
    def opens(self) -> list[bool]:
        """For each column whether it is the first of a group other than the first."""
        return [i > 0 and self.columns[i - 1].group != c.group for i, c in enumerate(self.columns)]

    @property
    def by_group(self) -> Iterator[tuple[str, list[Row]]]:
        """The rows of each group."""
        return ((group, list(rows)) for group, rows in groupby(self.rows, key=lambda row: row.group))

    def transposed(self, name: str = "") -> "Table":
        """A row for each column, under the titles of their groups, and a column for each row; the caption follows.

        The marks of the notes are in alphabetical order from row to row.
        """
        columns = tuple(Column(row.full_name) for row in self.rows)
        cells = [row.cells or (Cell(DASH),) * len(self.columns) for row in self.rows]
        rows = tuple(
            Row(column.heading, tuple(of[i] for of in cells), group=column.group, term=column.term)
            for i, column in enumerate(self.columns)
        )
        marks = dict.fromkeys(cell.note for row in rows for cell in row.cells if cell.note)
        renamed = dict(zip(marks, sorted(marks, key=lambda mark: (len(mark), mark)), strict=True))
        rows = tuple(
            replace(row, cells=tuple(cell._replace(note=renamed.get(cell.note, "")) for cell in row.cells))
            for row in rows
        )
        notes = tuple(sorted((renamed.get(mark, mark), text) for mark, text in self.notes))
        caption = self.caption.replace("Best of a column", "Best of a row")
        return replace(self, columns=columns, rows=rows, name=name, caption=caption, notes=notes)


def mark_best(better: Better, values: Mapping[str, Value], rivals: Collection[str]) -> dict[str, Cell]:
    """The cells of a column by name; the best among the rivals are marked, all of equal printed value."""
    first = best(better, {name: value.value for name, value in values.items() if name in rivals})
    text = None if first is None else interval(first, nan, nan)
    return {
        name: Cell(value.text, best=name in rivals and interval(value.value, nan, nan) == text)
        for name, value in values.items()
    }


def best(better: Better, values: Mapping[str, float]) -> float | None:
    """The best of the finite values; None without a direction, and where fewer than two are known."""
    known = [value for value in values.values() if isfinite(value)]
    if better is Better.NEITHER or len(known) < 2:
        return None
    return min(known) if better is Better.LOWER else max(known)
