"""The table of every report, and its writers for terminal, Markdown, LaTeX and notebooks, which escape file content."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import groupby
from math import isfinite, nan
from typing import Literal, NamedTuple, Self

from fgbaseline.compare.acceptance_limits import Better

from ..formatting import DASH, interval, md, tex
from ..results.metric_record import Metric, Value

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
        columns = tuple(Column(_name(row)) for row in self.rows)
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


def print_table(
    table: Table,
    *,
    width: int = UNWRAPPED,
    styles: Mapping[str, str] | None = None,
    spaced: bool = False,
    wrap_names: bool = True,
) -> None:
    """Prints the table; `styles` has rich's style for the rows of a status, `spaced` leaves a line between rows.

    Columns that do not fit side by side stand in several tables below one another: values, intervals and words are
    never broken.
    """
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    console = Console(highlight=False)
    if not console.is_terminal:  # rich prints no wider than its console
        console = Console(highlight=False, width=max(console.width, width))
    room = console.width
    names = [f"{row.group}: {row.name}" if row.group else row.name for row in table.rows]
    texts = [[cell.text for cell in row.cells] or [""] * len(table.columns) for row in table.rows]
    first = _Width.of([table.name, *names], wrapped=wrap_names)
    cells = [
        _Width.of([text[i] for text in texts], wrapped=column.words) | _Width.of([column.heading], wrapped=True)
        for i, column in enumerate(table.columns)
    ]
    gap = 1 if spaced else 2
    for number, block in enumerate(_blocks(cells, room - first.least, gap) or [[]]):
        if number:
            console.print()
        widths = _grown([first, *(cells[i] for i in block)], room - gap * len(block))
        shown = RichTable(box=None, header_style="bold", pad_edge=False, padding=(0, 1, 1, 0) if spaced else (0, 1))
        shown.add_column(table.name, width=widths[0], overflow="fold")
        for i, fitted in zip(block, widths[1:], strict=True):
            column = table.columns[i]
            justify: Literal["left", "right"] = "left" if column.words else "right"
            shown.add_column(Text(column.heading), justify=justify, width=fitted, overflow="fold")
        for row, name, text in zip(table.rows, names, texts, strict=True):
            shown.add_row(*map(Text, (name, *(text[i] for i in block))), style=(styles or {}).get(row.status, ""))
        console.print(shown)
    for row, name in zip(table.rows, names, strict=True):
        if row.reason and not row.cells:
            console.print(Text(f"{name}: {row.reason}"), soft_wrap=True)


class _Width(NamedTuple):
    """Width of a column in characters: the least, at which no word breaks, and that at which no line breaks."""

    least: int
    full: int

    @classmethod
    def of(cls, texts: Sequence[str], *, wrapped: bool) -> Self:
        full = max((len(line) for text in texts for line in text.split("\n")), default=0)
        words = max((len(word) for text in texts for word in text.replace(" ", "\n").split("\n")), default=0)
        return cls(words if wrapped else full, full)

    def __or__(self, other: Self) -> "_Width":
        return _Width(max(self.least, other.least), max(self.least, other.least, self.full))


def _blocks(columns: Sequence[_Width], room: int, gap: int) -> list[list[int]]:
    """Numbers of the columns that stand side by side in the room, block by block; one at least in each."""
    blocks: list[list[int]] = []
    left = 0
    for i, column in enumerate(columns):
        if not blocks or left < column.least + gap:
            blocks.append([])
            left = room
        blocks[-1].append(i)
        left -= column.least + gap
    return blocks


def _grown(columns: Sequence[_Width], room: int) -> list[int]:
    """Widths of the columns, of which the first ones use what the least widths leave of the room."""
    left = max(0, room - sum(column.least for column in columns))
    widths = []
    for least, full in columns:
        more = min(left, full - least)
        left -= more
        widths.append(least + more)
    return widths


def markdown(table: Table) -> str:
    """The table in Markdown, its caption and notes below; rows of a group begin with its title."""
    grouped = any(row.group for row in table.rows)
    first = ["", ""] if grouped else [table.name]
    align = [*(":--" for _ in first), *(":--" if column.words else "--:" for column in table.columns)]
    lines: list[Sequence[str]] = [[*first, *(md(column.heading) for column in table.columns)], align]
    for row in table.rows:
        cells = [f"**{md(cell.text)}**" if cell.best else md(cell.text) for cell in row.cells]
        cells = [
            f"{text} <sup>{cell.note}</sup>" if cell.note else text for text, cell in zip(cells, row.cells, strict=True)
        ]
        if row.reason and not row.cells:
            cells = [md(row.reason), *[""] * (len(table.columns) - 1)]
        lines.append([*([md(row.group)] if grouped else []), md(_name(row)), *cells])
    caption = ["", md(table.caption)] if table.caption else []
    notes = ["", *(f"- <sup>{mark}</sup> {md(text)}." for mark, text in table.notes)] if table.notes else []
    return "\n".join([*(f"| {' | '.join(line)} |" for line in lines), *caption, *notes, ""])


def html(table: Table) -> str:
    """The table in HTML without style, for a notebook; rows of a group begin with its title."""
    left = 'style="text-align: left"'
    head = "".join(f"<th>{escape(column.heading)}</th>" for column in table.columns)
    lines = [f"<tr><th {left}>{escape(table.name)}</th>{head}</tr>"]
    for row in table.rows:
        texts = [f"<b>{escape(c.text)}</b>" if c.best else escape(c.text) for c in row.cells] or [escape(row.reason)]
        name = f"{row.group}: {_name(row)}" if row.group else _name(row)
        lines.append(f"<tr><th {left}>{escape(name)}</th>{''.join(f'<td>{text}</td>' for text in texts)}</tr>")
    return f"<table>{''.join(lines)}</table><p>{escape(table.caption)}</p>"


def latex(table: Table) -> str:
    """The table in LaTeX (booktabs), a group of lines for each group of rows, the notes below; the best in bold."""
    n = len(table.columns)
    body: list[str] = []
    for group, rows in table.by_group:
        if group:
            body += [r"\midrule", rf"\multicolumn{{{n + 1}}}{{l}}{{\emph{{{tex(group)}}}}} \\"]
        for row in rows:
            cells = [rf"\textbf{{{tex(cell.text)}}}" if cell.best else tex(cell.text) for cell in row.cells]
            marks = [rf"\textsuperscript{{{cell.note}}}" if cell.note else "" for cell in row.cells]
            cells = [text + mark for text, mark in zip(cells, marks, strict=True)]
            if row.reason and not row.cells:
                cells = [rf"\multicolumn{{{n}}}{{l}}{{{tex(row.reason)}}}"]
            body.append(" & ".join([rf"\quad {tex(_name(row))}", *cells]) + r" \\")
    notes = [rf"\textsuperscript{{{mark}}} {tex(text)}." for mark, text in table.notes]
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
            *([r"\par\smallskip\footnotesize", *notes] if notes else []),
            r"\end{table}",
            "",
        ]
    )


def _name(row: Row) -> str:
    return f"{row.name} (reference)" if row.reference else row.name
