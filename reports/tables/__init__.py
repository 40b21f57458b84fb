"""One table model, and one writer of it for the terminal, for Markdown and for LaTeX; HTML has a macro for it."""

from .table import Cell, Column, Row, Table, Value, best, compared
from .writers import latex, markdown, print_table

__all__ = ["Cell", "Column", "Row", "Table", "Value", "best", "compared", "latex", "markdown", "print_table"]
