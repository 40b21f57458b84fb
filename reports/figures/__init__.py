"""Figures in matplotlib, in two styles (screen and paper), with one color for an estimator everywhere."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .diagnosis import draw_diagnosis
    from .palette import colors
    from .run import draw, draw_for_paper, drawn_in_background
    from .run_data import RunData, of_folder, of_run
    from .saving import EncodedFigure, encoded, save
else:
    from fgbaseline.geometry.lazy_names import lazy_names

    __getattr__ = lazy_names(
        __name__,
        {
            "diagnosis": "draw_diagnosis",
            "palette": "colors",
            "run": "draw draw_for_paper drawn_in_background",
            "run_data": "RunData of_folder of_run",
            "saving": "EncodedFigure encoded save",
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
