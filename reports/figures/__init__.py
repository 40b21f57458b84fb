"""Figures in matplotlib, in two styles (screen and paper), with one color for an estimator everywhere."""

from .diagnosis import draw_diagnosis
from .run import being_drawn, draw, draw_and_write, draw_printed
from .run_data import RunData, of_folder, of_run
from .saving import Written, encoded, save
from .style import colors

__all__ = [
    "RunData",
    "Written",
    "being_drawn",
    "colors",
    "draw",
    "draw_and_write",
    "draw_diagnosis",
    "draw_printed",
    "encoded",
    "of_folder",
    "of_run",
    "save",
]
