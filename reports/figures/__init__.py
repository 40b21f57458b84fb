"""Figures of a run, in matplotlib: drawn from the comparison, one look, one colour for an estimator everywhere."""

from .diagnosis import draw_diagnosis
from .drawing import draw
from .palette import colours
from .saving import encoded, save

__all__ = ["colours", "draw", "draw_diagnosis", "encoded", "save"]
