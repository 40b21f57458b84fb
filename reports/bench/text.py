"""The main table in Markdown and in LaTeX."""

from ..formatting import md as escaped
from ..formatting import tex
from .grid import Grid


def markdown(grid: Grid) -> str:
    """In Markdown, the caption below."""
    lines = [["case", "estimator", *grid.headings], [":--", ":--", *["--:"] * len(grid.headings)]]
    for row in grid.rows:
        cells = [f"**{escaped(c)}**" if best else escaped(c) for c, best in zip(row.cells, row.best, strict=True)]
        if row.reason:
            cells = [f"failed: {escaped(row.reason)}", *[""] * (len(cells) - 1)]
        lines.append([escaped(row.case), escaped(row.name), *cells])
    return "\n".join([*(f"| {' | '.join(line)} |" for line in lines), "", escaped(grid.caption), ""])


def latex(grid: Grid) -> str:
    """In LaTeX (booktabs): a group of lines for each case."""
    n = len(grid.headings)
    body: list[str] = []
    for case, rows in grid.by_case:
        body += [r"\midrule", rf"\multicolumn{{{n + 1}}}{{l}}{{\emph{{{tex(case)}}}}} \\"]
        for row in rows:
            cells = [rf"\textbf{{{tex(c)}}}" if best else tex(c) for c, best in zip(row.cells, row.best, strict=True)]
            if row.reason:
                cells = [rf"\multicolumn{{{n}}}{{l}}{{failed: {tex(row.reason)}}}"]
            body.append(" & ".join([rf"\quad {tex(row.name)}", *cells]) + r" \\")
    return "\n".join(
        [
            r"% needs \usepackage{booktabs}",
            r"\begin{table}",
            r"\centering",
            rf"\caption{{{tex(grid.caption)}}}",
            rf"\begin{{tabular}}{{l{'r' * n}}}",
            r"\toprule",
            " & ".join(["", *map(tex, grid.headings)]) + r" \\",
            *body,
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
            "",
        ]
    )
