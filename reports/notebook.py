"""Results in a terminal and in a notebook: conclusions in at most five lines, and the main table as HTML."""

from html import escape
from typing import Protocol

from fgbaseline.data.display import LINES, cut

from .tables import Table, html


class _Result(Protocol):
    @property
    def heading(self) -> str: ...
    @property
    def verdict(self) -> list[str]: ...
    @property
    def text_table(self) -> Table: ...


class NotebookResult:
    """Result whose `repr` is a heading with its first conclusions, and whose HTML has all of them and its table."""

    __slots__ = ()

    def __repr__(self: _Result) -> str:
        return "\n".join(map(cut, [self.heading, *(f"  {text}" for text in self.verdict[: LINES - 1])]))

    def _repr_html_(self: _Result) -> str:
        sentences = "".join(f"<li>{escape(text)}</li>" for text in self.verdict)
        return f"<b>{escape(self.heading)}</b><ul>{sentences}</ul>{html(self.text_table)}"
