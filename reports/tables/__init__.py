"""One table model, and one writer of it for the terminal, Markdown, LaTeX and notebooks; pages have a macro for it."""

from .table import UNWRAPPED, Cell, Column, Row, Table, best, html, latex, mark_best, markdown, print_table

__all__ = [
    "UNWRAPPED",
    "Cell",
    "Column",
    "Row",
    "Table",
    "best",
    "html",
    "latex",
    "mark_best",
    "markdown",
    "print_table",
]
