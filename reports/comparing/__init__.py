"""Trajectories from anywhere against one another: tables, figures, page and folder, from Python or the command line."""

from .calling import compare
from .comparison import Comparison, Result
from .settings import Delta, Settings

__all__ = ["Comparison", "Delta", "Result", "Settings", "compare"]
