"""Trajectories from anywhere against one another: tables, figures, page and folder, from Python or the command line."""

from ..trajectories.comparison import Comparison, Result
from ..trajectories.settings import Delta, Settings
from .api import ComparisonReport, compare

__all__ = ["Comparison", "ComparisonReport", "Delta", "Result", "Settings", "compare"]
