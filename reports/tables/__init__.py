"""One table model, and one writer of it for the terminal, Markdown, LaTeX and notebooks; pages have a macro for it."""

from .table import UNWRAPPED, Cell, Column, Row, Table, best, compared, html, latex, markdown, print_table

__all__ = [
    "UNWRAPPED",
    "Cell",
    "Column",
    "Row",
    "Table",
    "best",
    "compared",
    "html",
    "latex",
    "markdown",
    "print_table",
]
