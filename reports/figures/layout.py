"""Where everything in a figure stands: found once, then held, however often and in whatever form it is written."""

from collections import defaultdict
from contextlib import AbstractContextManager

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox, blended_transform_factory

from .grid import fill_grid
from .log_axis import draw_minor_ticks_at_once, label_with_numbers


def lay_out(figure: Figure) -> None:
    """Places panels, titles and the labels of axes for good, at round positions.

    Every drawing would otherwise ask all tick labels of all panels again where a title or a label has room.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            label_with_numbers(axis)
        axes.set_title(axes.get_title(loc="left"), loc="left", y=1.0)
    draw_minor_ticks_at_once(figure.axes)
    fill_grid(figure)
    # "none" would leave a layout engine that does nothing, but for which every figure is drawn twice
    with held():
        figure.set_layout_engine(None)
    for axes in figure.axes:
        axes.set_position(Bbox(np.round(axes.get_position(original=True).get_points(), 4)))
        axes.apply_aspect()
    _hold_labels(figure)


def held() -> AbstractContextManager[None]:
    """Within it nothing gives a figure a layout engine anew, as saving it would."""
    return mpl.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False})


def _hold_labels(figure: Figure) -> None:
    """Labels stay where they are, those of the ordinates of a column of panels in one line."""
    inches = figure.dpi_scale_trans
    columns: dict[int, list[tuple[Axes, float]]] = defaultdict(list)
    for axes in figure.axes:
        if axes.xaxis.label.get_text():
            axes.xaxis.get_tightbbox()
            down = round(axes.xaxis.label.get_position()[1] / figure.dpi, 3)
            axes.xaxis.set_label_coords(0.5, down, blended_transform_factory(axes.transAxes, inches))
        if axes.yaxis.label.get_text():
            axes.yaxis.get_tightbbox()
            place = axes.get_subplotspec()
            column = -1 - len(columns) if place is None else place.colspan.start
            columns[column].append((axes, axes.yaxis.label.get_position()[0] / figure.dpi))
    for panels in columns.values():
        left = round(min(x for _, x in panels), 3)
        for axes, _ in panels:
            axes.yaxis.set_label_coords(left, 0.5, blended_transform_factory(inches, axes.transAxes))
