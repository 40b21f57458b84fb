"""The table of every report and its writers for terminal, Markdown and LaTeX, which escape what comes from files."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from math import isfinite, nan
from typing import NamedTuple, Self

from fgbaseline.compare.limits import Better

from ..formatting import interval, md, tex
from ..results.metric import Metric, Value

UNWRAPPED = 160
"""columns of a table where no terminal says how many there are"""


@dataclass(frozen=True, slots=True)
class Column:
    """Heading of a column."""

    title: str
    group: str = ""
    unit: str = ""
    words: bool = False
    """whether its cells are words, which are aligned to the left"""
    term: str = ""
    """of the glossary"""

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
    term: str = ""
    """of the glossary"""


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
    def groups(self) -> list[tuple[str, int, str]]:
        """Title of each group of columns, how many it spans, and their common term; empty where none has a title."""
        spans = [(group, list(columns)) for group, columns in groupby(self.columns, key=lambda column: column.group)]
        if not any(group for group, _ in spans):
            return []
        return [(g, len(of), of[0].term if len({c.term for c in of}) == 1 else "") for g, of in spans]

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
        """A row for each column, under the titles of their groups, and a column for each row."""
        columns = tuple(Column(f"{row.name} (reference)" if row.reference else row.name) for row in self.rows)
        rows = tuple(
            Row(column.heading, tuple(row.cells[i] for row in self.rows), group=column.group, term=column.term)
            for i, column in enumerate(self.columns)
        )
        return replace(self, columns=columns, rows=rows, name=name)


def compared(better: Better, values: Mapping[str, Value], rivals: Collection[str]) -> dict[str, Cell]:
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


def print_table(
    table: Table,
    *,
    width: int = UNWRAPPED,
    styles: Mapping[str, str] | None = None,
    spaced: bool = False,
    wrap_names: bool = True,
) -> None:
    """Prints the table; `styles` has rich's style for the rows of a status, `spaced` leaves a line between rows."""
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    shown = RichTable(box=None, header_style="bold", pad_edge=False, padding=(0, 1, 1, 0) if spaced else (0, 1))
    shown.add_column(table.name, overflow="fold", no_wrap=not wrap_names)
    for column in table.columns:
        shown.add_column(Text(column.heading), justify="left" if column.words else "right", overflow="fold")
    for row in table.rows:
        name = f"{row.group}: {row.name}" if row.group else row.name
        style = (styles or {}).get(row.status, "")
        shown.add_row(*map(Text, (name, *_texts(table, row))), style=style)
    console = Console()
    Console(width=None if console.is_terminal else max(console.width, width), highlight=False).print(shown)


def markdown(table: Table) -> str:
    """The table in Markdown, its caption below; rows of a group begin with its title."""
    grouped = any(row.group for row in table.rows)
    first = ["", ""] if grouped else [table.name]
    align = [*(":--" for _ in first), *(":--" if column.words else "--:" for column in table.columns)]
    lines: list[Sequence[str]] = [[*first, *(md(column.heading) for column in table.columns)], align]
    for row in table.rows:
        cells = [f"**{md(cell.text)}**" if cell.best else md(cell.text) for cell in row.cells]
        if row.reason and not row.cells:
            cells = [md(row.reason), *[""] * (len(table.columns) - 1)]
        lines.append([*([md(row.group)] if grouped else []), md(_name(row)), *cells])
    caption = ["", md(table.caption)] if table.caption else []
    return "\n".join([*(f"| {' | '.join(line)} |" for line in lines), *caption, ""])


def latex(table: Table) -> str:
    """The table in LaTeX (booktabs), a group of lines for each group of rows; the best of a column in bold."""
    n = len(table.columns)
    body: list[str] = []
    for group, rows in table.by_group:
        if group:
            body += [r"\midrule", rf"\multicolumn{{{n + 1}}}{{l}}{{\emph{{{tex(group)}}}}} \\"]
        for row in rows:
            cells = [rf"\textbf{{{tex(cell.text)}}}" if cell.best else tex(cell.text) for cell in row.cells]
            if row.reason and not row.cells:
                cells = [rf"\multicolumn{{{n}}}{{l}}{{{tex(row.reason)}}}"]
            body.append(" & ".join([rf"\quad {tex(_name(row))}", *cells]) + r" \\")
    return "\n".join(
        [
            r"% needs \usepackage{booktabs}",
            r"\begin{table}",
            r"\centering",
            rf"\caption{{{tex(table.caption)}}}",
            rf"\begin{{tabular}}{{l{'r' * n}}}",
            r"\toprule",
            " & ".join(["", *(tex(column.heading) for column in table.columns)]) + r" \\",
            *body,
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def _name(row: Row) -> str:
    return f"{row.name} (reference)" if row.reference else row.name


def _texts(table: Table, row: Row) -> list[str]:
    if row.reason and not row.cells:
        return [row.reason, *[""] * (len(table.columns) - 1)]
    return [cell.text for cell in row.cells]
