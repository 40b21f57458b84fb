"""The estimators by name: ours and those of other packages, through the entry point group `fgbaseline.estimators`."""

import inspect
import re
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import TypeAlias

from fgbaseline.geometry import InputError

from ..problem import Problem
from .estimate import Estimate, Progress

Estimator: TypeAlias = Callable[[Problem, Progress | None], Estimate]

GROUP = "fgbaseline.estimators"


def estimator_names() -> list[str]:
    """The names under which estimators are installed, sorted."""
    return sorted(_installed())


def find_estimator(name: str) -> Estimator:
    """The estimator registered as `name`; it is imported here. Raises InputError for an unknown name."""
    installed = _installed()
    if name not in installed:
        raise InputError(f"there is no estimator '{name}'; installed are: {', '.join(sorted(installed))}")
    solve: Estimator = installed[name].load()
    return solve


def estimator_summaries() -> dict[str, str]:
    """First sentence on each installed estimator by name, or why it cannot be imported. Imports all of them."""
    return {name: _summary(point) for name, point in sorted(_installed().items())}


def _summary(point: EntryPoint) -> str:
    try:
        text = inspect.getdoc(point.load()) or ""
    except Exception as error:  # a filter of another package may raise anything
        return f"cannot be imported: {type(error).__name__}: {error}"
    first = " ".join(text.partition("\n\n")[0].split())
    return re.split(r"(?<=\.) ", first)[0] or f"{point.value}, which has no docstring"


def _installed() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}
