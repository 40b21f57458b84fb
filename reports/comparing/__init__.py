"""Trajectories from anywhere against one another: tables, figures, page and folder, from Python or the command line."""

from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.settings import Delta, Settings

from .api import ComparisonReport, compare

__all__ = ["Comparison", "ComparisonReport", "Delta", "Result", "Settings", "compare"]
