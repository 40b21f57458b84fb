"""Results in Python: their text, HTML and report; and functions whose errors name keywords in place of options."""

import re
from collections.abc import Callable, Iterator
from functools import wraps
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, ParamSpec, Protocol, TypeVar, get_args, get_origin

from fgbaseline.data.display import LINES, cut
from fgbaseline.data.formats.files.atomic_folder import atomic_folder
from fgbaseline.data.formats.files.atomic_write import atomic_write
from fgbaseline.data.formats.files.file_errors import FilePath
from fgbaseline.geometry import InputError

if TYPE_CHECKING:
    from .tables.table import Table

P = ParamSpec("P")
R = TypeVar("R")
KEYWORDS = {"--force": "force=True", "--out": "path", "--out DIR": "path"}
"""options that have another name in Python"""


class _Result(Protocol):
    @property
    def heading(self) -> str: ...
    @property
    def verdict(self) -> list[str]: ...
    @property
    def text_table(self) -> "Table": ...


class NotebookResult:
    """Result whose `repr` is a heading with its first conclusions, and whose HTML has all of them and its table."""

    __slots__ = ()

    def __repr__(self: _Result) -> str:
        return "\n".join(map(cut, [self.heading, *(f"  {text}" for text in self.verdict[: LINES - 1])]))

    def _repr_html_(self: _Result) -> str:
        from .tables.writers import html

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


def for_python(function: Callable[P, R]) -> Callable[P, R]:
    """The function with InputErrors that name keywords, for values as well that a `Literal` keyword does not list."""

    @wraps(function)
    def called(*arguments: P.args, **keywords: P.kwargs) -> R:
        try:
            _require_choices(function, keywords)
            return function(*arguments, **keywords)
        except InputError as error:
            raise InputError(in_python(str(error))) from None

    return called


def in_python(sentence: str) -> str:
    """The sentence with `held_out` in place of `--held-out`, and of `held-out:` at its beginning."""
    named = re.sub(r"--[a-z][a-z-]*", lambda m: KEYWORDS.get(m[0], m[0][2:].replace("-", "_")), sentence)
    return re.sub(r"^[a-z]+(-[a-z]+)+(?=: )", lambda m: m[0].replace("-", "_"), named)


def _require_choices(function: Callable[..., object], keywords: dict[str, Any]) -> None:
    hints = function.__annotations__  # a type in quotes, which is imported on use, has no Literal in it
    for name, value in keywords.items():
        choices = list(_choices(hints.get(name)))
        if choices and isinstance(value, str) and value not in choices:
            raise InputError(f"{name}: expected {', '.join(map(repr, choices[:-1]))} or {choices[-1]!r}, got {value!r}")


def _choices(hint: object) -> Iterator[str]:
    """Texts that a type lists; none where it allows any text."""
    parts = get_args(hint)
    if str in parts:
        return
    if get_origin(hint) is Literal:
        yield from (part for part in parts if isinstance(part, str))
    elif not isinstance(hint, type):
        for part in parts:
            yield from _choices(part)
