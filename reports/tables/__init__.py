"""One table model, and one writer of it for the terminal, for Markdown and for LaTeX; HTML has a macro for it."""

from .table import UNWRAPPED, Cell, Column, Row, Table, best, compared, latex, markdown, print_table

__all__ = ["UNWRAPPED", "Cell", "Column", "Row", "Table", "best", "compared", "latex", "markdown", "print_table"]
