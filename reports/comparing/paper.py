"""The main table as text for papers and pages: Markdown and LaTeX."""

from itertools import groupby

from ..formatting import tex
from .comparison import Comparison
from .tables import text_table


def markdown(comparison: Comparison) -> str:
    """The table in Markdown, its caption below."""
    names, lines = text_table(comparison)
    rows = [["", *names], ["---", *["---:"] * len(names)], *([line.title, *line.cells] for line in lines)]
    table = ["| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in rows]
    return "\n".join([*table, "", comparison.caption, ""])


def latex(comparison: Comparison) -> str:
    """The table in LaTeX (booktabs), its caption with it; the best of a line in bold."""
    names, lines = text_table(comparison)
    body: list[str] = []
    for group, same in groupby(lines, key=lambda line: line.group):
        body += [r"\midrule", rf"\multicolumn{{{len(names) + 1}}}{{l}}{{\emph{{{tex(group)}}}}} \\"]
        for line in same:
            cells = [
                rf"\textbf{{{tex(cell)}}}" if best else tex(cell)
                for cell, best in zip(line.cells, line.best, strict=True)
            ]
            body.append(" & ".join([rf"\quad {tex(line.heading)}", *cells]) + r" \\")
    return "\n".join(
        [
            r"% needs \usepackage{booktabs}",
            r"\begin{table}",
            r"\centering",
            rf"\caption{{{tex(comparison.caption)}}}",
            rf"\begin{{tabular}}{{l{'r' * len(names)}}}",
            r"\toprule",
            " & ".join(["", *map(tex, names)]) + r" \\",
            *body,
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
            "",
        ]
    )
