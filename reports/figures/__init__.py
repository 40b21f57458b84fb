"""Figures in matplotlib, in two styles (screen and paper), with one color for an estimator everywhere."""

from .diagnosis import draw_diagnosis
from .run import draw, draw_and_write, draw_for_paper, drawn_in_background
from .run_data import RunData, of_folder, of_run
from .saving import EncodedFigure, encoded, save
from .style import colors

__all__ = [
    "EncodedFigure",
    "RunData",
    "colors",
    "draw",
    "draw_and_write",
    "draw_diagnosis",
    "draw_for_paper",
    "drawn_in_background",
    "encoded",
    "of_folder",
    "of_run",
    "save",
]
