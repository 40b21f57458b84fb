"""Comparison of trajectories from files: tables, figures, page and folder, from Python or the command line."""

from typing import TYPE_CHECKING

from .api import compare

if TYPE_CHECKING:
    from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
    from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings

    from .report import ComparisonReport
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "fgbaseline.compare.trajectory_comparison.comparison": "Comparison Result",
            "fgbaseline.compare.trajectory_comparison.settings": "Delta Settings",
            "report": "ComparisonReport",
        },
    )

__all__ = ["Comparison", "ComparisonReport", "Delta", "Result", "Settings", "compare"]
