"""Figures of a run, in matplotlib: drawn from the comparison, one look, one colour for an estimator everywhere."""

from .drawing import draw
from .palette import colours
from .saving import encoded, save

__all__ = ["colours", "draw", "encoded", "save"]
