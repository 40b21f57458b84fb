"""Estimators of the user in a Python file, given as `[NAME=]FILE:FUNCTION`: no package has to be installed."""

import importlib.util
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from fgbaseline.geometry import InputError

from .registry import Estimator, estimator_names

FORM = "[NAME=]FILE:FUNCTION, such as mine.py:solve"


class UserEstimator(NamedTuple):
    """A function in a file, and the name that tables and files use."""

    name: str
    path: Path
    function: str


def parse(text: str) -> UserEstimator:
    """Parses `[NAME=]FILE:FUNCTION`; the default name is FUNCTION. Raises InputError for other text."""
    named = re.fullmatch(r"(?:([^=:/\\]*)=)?(.+):([^:/\\]+)", text)
    if named is None or not named[3].isidentifier():
        raise InputError(f"estimator: '{text}' is not of the form {FORM}")
    name, path, function = named.groups()
    if name is None:
        name = function
    if not re.fullmatch(r"[\w][\w .+-]*", name):
        raise InputError(f"estimator: '{name}' in '{text}' cannot be the name of a file; give another NAME=")
    if name in estimator_names():
        raise InputError(f"estimator: '{name}' is installed already; give another name, such as mine={path}:{function}")
    return UserEstimator(name, Path(path), function)


def load(wanted: UserEstimator) -> Estimator:
    """The function. Raises InputError where the file cannot be imported or has no such function.

    The file is executed once, as `python FILE` would without its `if __name__ == "__main__"` part; modules beside it
    can be imported.
    """
    path = wanted.path
    if not path.is_file():
        raise InputError(f"estimator: there is no file {path}")
    name = f"fgbaseline_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"estimator: {path} is not a Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    with _importable(path.resolve().parent):
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except Exception as error:
            del sys.modules[name]
            raise InputError(f"estimator: {path} cannot be imported: {type(error).__name__}: {error}") from error
    solve = getattr(module, wanted.function, None)
    if not callable(solve):
        there = [n for n, value in vars(module).items() if callable(value) and not n.startswith("_")]
        found = f"; it has {', '.join(there[:8])}" if there else ""
        raise InputError(f"estimator: {path} has no function '{wanted.function}'{found}")
    function: Estimator = solve
    return function


def load_all(texts: tuple[str, ...]) -> Mapping[str, Callable[..., object]]:
    """Functions by name. Raises InputError for a name that is given twice."""
    loaded: dict[str, Callable[..., object]] = {}
    for wanted in map(parse, texts):
        if wanted.name in loaded:
            raise InputError(f"estimator: '{wanted.name}' is given twice; give one of them another NAME=")
        loaded[wanted.name] = load(wanted)
    return loaded


@contextmanager
def _importable(folder: Path) -> Iterator[None]:
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
