"""Comparison of a visual-inertial filter with a factor-graph reference on the same problem.

    result = fgbaseline.run("drive.npz", estimators=["ekf", "isam2", my_filter])
    result.table, result.verdict, result.figures()
    result.report("out/drive")

    fgbaseline.compare_trajectories("truth.tum", {"mine": (t, poses)}, align="yaw").table

`help(fgbaseline.run)` lists the options. Packages and functions are imported at their first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fgbaseline import compare, data, diagnosis, ekf, geometry, reports, smoother
    from fgbaseline.reports.comparison.api import compare_trajectories
    from fgbaseline.reports.run.api import run

    __version__: str

__all__ = [
    "__version__",
    "compare",
    "compare_trajectories",
    "data",
    "diagnosis",
    "ekf",
    "geometry",
    "reports",
    "run",
    "smoother",
]
FUNCTIONS = {"run": "fgbaseline.reports.run.api", "compare_trajectories": "fgbaseline.reports.comparison.api"}
"""name -> module"""


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


if not TYPE_CHECKING:  # with it, type checkers would take any name for an attribute

    def __getattr__(name: str) -> Any:
        """A function, package or version that is not imported yet. Raises AttributeError for any other name."""
        if name not in __all__:
            raise AttributeError(f"module 'fgbaseline' has no attribute '{name}'")
        if name == "__version__":
            return import_module("importlib.metadata").version("fgbaseline")
        if name in FUNCTIONS:
            return getattr(import_module(FUNCTIONS[name]), name)
        return import_module(f"fgbaseline.{name}")
