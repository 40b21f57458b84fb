"""Figures in matplotlib, in two styles (screen and paper), with one color for an estimator everywhere."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .diagnosis import draw_diagnosis
    from .drawing import EncodedFigure, encoded, save
    from .run import draw, draw_for_paper, drawn_in_background
    from .run_data import RunData, of_folder, of_run
    from .style import colors
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "diagnosis": "draw_diagnosis",
            "drawing": "EncodedFigure encoded save",
            "run": "draw draw_for_paper drawn_in_background",
            "run_data": "RunData of_folder of_run",
            "style": "colors",
        },
    )

__all__ = [
    "EncodedFigure",
    "RunData",
    "colors",
    "draw",
    "draw_diagnosis",
    "draw_for_paper",
    "drawn_in_background",
    "encoded",
    "of_folder",
    "of_run",
    "save",
]
