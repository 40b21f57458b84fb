"""A table as text: on the terminal, in Markdown and in LaTeX. What comes from files is escaped."""

from collections.abc import Mapping, Sequence

from ..formatting import md, tex
from .table import Row, Table

UNWRAPPED = 160
"""columns of a table where no terminal says how many there are"""


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
