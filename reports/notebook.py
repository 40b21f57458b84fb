"""Results in Python: conclusions in at most five lines, the main table as HTML, and the page or folder they write."""

from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Protocol

from fgbaseline.data.display import LINES, cut
from fgbaseline.data.formats.atomic_folder import atomic_folder
from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.formats.file_errors import FilePath

from .tables.table import Table
from .tables.writers import html


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


def write_report(
    path: FilePath, page: Callable[[], str], fill: Callable[[Path], object], *, force: bool, mark: str
) -> Path:
    """Writes the page alone where `path` ends in `.html`, else a folder that `fill` fills; returns the page's path.

    Both are atomic. Raises InputError where `path` exists without `force`, or is not a folder with the file `mark`.
    """
    place = Path(path)
    if place.suffix.lower() == ".html":
        with atomic_write(place, force=force) as file:
            file.write(page().encode("utf-8"))
        return place
    with atomic_folder(place, force=force, mark=mark) as building:
        fill(building)
    return place / "report.html"
