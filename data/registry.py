"""The estimators by name: ours and those of other packages, through the entry point group `fgbaseline.estimators`."""

from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import TypeAlias

from fgbaseline.geometry import InputError

from .estimate import Estimate, Progress
from .problem import Problem

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


def _installed() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}
