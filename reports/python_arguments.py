"""Functions for Python: errors name keywords in place of the command's options, and choices are checked."""

import re
from collections.abc import Callable, Iterator
from functools import wraps
from typing import Any, Literal, ParamSpec, TypeVar, get_args, get_origin

from fgbaseline.geometry import InputError

P = ParamSpec("P")
R = TypeVar("R")
KEYWORDS = {"--force": "force=True", "--out": "path", "--out DIR": "path"}
"""options that have another name in Python"""


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
