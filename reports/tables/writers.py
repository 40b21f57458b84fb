"""Writers of tables for terminal, Markdown, LaTeX, notebooks and CSV, which escape file content."""

import csv
from collections.abc import Mapping, Sequence
from html import escape
from math import isnan
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..formatting import md, tex
from .table import Table

UNWRAPPED = 160
"""columns of a table where no terminal says how many there are"""
EXACT = "%r"
"""all digits"""


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
        lines.append([*([md(row.group)] if grouped else []), md(row.full_name), *cells])
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
        name = f"{row.group}: {row.full_name}" if row.group else row.full_name
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
            body.append(" & ".join([rf"\quad {tex(row.full_name)}", *cells]) + r" \\")
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


def write_csv(path: Path, columns: Mapping[str, Sequence[Any] | NDArray[Any]], form: str = EXACT) -> None:
    """Writes a row of names and one per value, as `DataFrame.to_csv` without an index; NaN is an empty cell.

    Numbers that are no integers are written in the form, such as `%.9g`. The import of pandas would take longer than
    most of these files.
    """
    lists = [column.tolist() if isinstance(column, np.ndarray) else column for column in columns.values()]
    cells = [[_cell(value, form) for value in values] for values in lists]
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(columns)
        rows.writerows(zip(*cells, strict=True))


def _cell(value: object, form: str) -> object:
    if not isinstance(value, float):
        return value
    return "" if isnan(value) else form % value
