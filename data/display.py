"""Text of dataclasses that hold arrays: at most five lines in a terminal, a table in a notebook."""

from collections.abc import Mapping, Sized
from dataclasses import fields
from enum import Enum
from html import escape
from typing import Any

LINES = 5
"""lines of a `repr`, its heading among them"""
WIDTH = 120
"""characters of a line"""


class Displayed:
    """Dataclass whose `repr` is a heading with at most four facts, and whose HTML is a table of all its facts.

    By default the facts are the fields that are not None, on one line: arrays by their shape, collections by their
    length, other dataclasses by their name. The class needs `repr=False`.
    """

    __slots__ = ()

    def _heading(self) -> str:
        """The first line."""
        return type(self).__name__

    def _facts(self) -> Mapping[str, str] | None:
        """Text by title, the most important first; None for the fields on one line."""
        return None

    def __repr__(self) -> str:
        facts = self._facts()
        if facts is None:
            return cut(f"{self._heading()}({', '.join(f'{k}={v}' for k, v in _fields(self).items())})")
        width = max(map(len, facts), default=0)
        rows = [f"  {title:{width}}  {text}" for title, text in list(facts.items())[: LINES - 1]]
        return "\n".join(cut(" ".join(line.splitlines())) for line in (self._heading(), *rows))

    def _repr_html_(self) -> str:
        """The table that a notebook shows."""
        facts = self._facts()
        left = 'style="text-align: left"'
        rows = "".join(
            f"<tr><th {left}>{escape(title)}</th><td {left}>{escape(text)}</td></tr>"
            for title, text in (_fields(self) if facts is None else facts).items()
        )
        return f"<table><caption><b>{escape(self._heading())}</b></caption>{rows}</table>"


def _fields(of: Any) -> dict[str, str]:
    return {f.name: _brief(value) for f in fields(of) if (value := getattr(of, f.name)) is not None}


def _brief(value: object) -> str:
    """A number or a short text as it is, an array or table by its shape, a collection by its length."""
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple):
        return f"array{shape}"
    if isinstance(value, Enum):
        return str(value)
    if isinstance(value, str | int | float | bool):
        return repr(value)
    if isinstance(value, Sized):
        return f"{type(value).__name__} of {len(value)}"
    return type(value).__name__


def cut(line: str) -> str:
    """The line, or its beginning with an ellipsis."""
    return line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}…"
