"""Comparison of a visual-inertial filter with a factor-graph reference on the same problem.

Packages are imported at their first use: `import fgbaseline` takes 30 ms.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fgbaseline import compare, data, diagnosis, ekf, geometry, reports, smoother

    __version__: str

__all__ = [
    "__version__",
    "compare",
    "data",
    "diagnosis",
    "ekf",
    "geometry",
    "reports",
    "smoother",
]


def __getattr__(name: str) -> Any:
    """A package or version that is not imported yet. Raises AttributeError for any other name."""
    if name not in __all__:
        raise AttributeError(f"module 'fgbaseline' has no attribute '{name}'")
    if name == "__version__":
        return import_module("importlib.metadata").version("fgbaseline")
    return import_module(f"fgbaseline.{name}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
