"""Figures of a run, in matplotlib: drawn from the comparison, one look, one colour for an estimator everywhere."""

from .diagnosis import draw_diagnosis
from .drawing import draw
from .palette import colours
from .saving import Written, encoded, save
from .sharing import being_drawn, draw_and_write

__all__ = ["Written", "being_drawn", "colours", "draw", "draw_and_write", "draw_diagnosis", "encoded", "save"]
