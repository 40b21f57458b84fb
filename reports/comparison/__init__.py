"""Comparison of trajectories from files: tables, figures, page and folder, from Python or the command line."""

from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings

from .report import ComparisonReport, compare

__all__ = ["Comparison", "ComparisonReport", "Delta", "Result", "Settings", "compare"]
