"""Panels of a figure in their grid, as large as what stands around them allows.

matplotlib's constrained layout in closed form, for figures that are one grid of panels below one legend: it solves for
sizes, looks, and solves again, and looking at every label of every tick is most of what it does. Here it is done once,
at sizes near those that come of it, and again only where that changed the ticks.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.transforms import Bbox
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray

PAD = 0.042
"""inches around each panel with its labels, and around the legend"""
USUAL = (0.6, 0.12, 0.25)
"""inches to the left and right of a panel and above it, by which it is sized before anything is measured"""
BELOW, BELOW_INNER = 0.5, 0.1
"""inches under a panel of the lowest row, and of those above"""
PASSES = 3
"""at most, of measuring and placing; a second one is needed where a panel has other ticks at its new size"""
LEFT, RIGHT, BOTTOM, TOP = range(4)


def fill_grid(figure: Figure) -> None:
    """Places the panels of a figure that are in a grid (the same for all of them), below its legends."""
    panels = [(axes, spec) for axes in figure.axes if (spec := axes.get_subplotspec()) is not None]
    if not panels:
        return
    FigureCanvasAgg(figure)  # measures without drawing
    size = figure.get_size_inches()
    head = max((legend.get_window_extent().height / figure.dpi + 2.0 * PAD for legend in figure.legends), default=0.0)
    _place(panels, np.array([_usual(spec) for _, spec in panels]), size, head)
    for _ in range(PASSES):
        ticks = _ticks(panels)
        _place(panels, np.array([_around(axes) for axes, _ in panels]) / figure.dpi, size, head)
        if _ticks(panels) == ticks:
            break


def _ticks(panels: list[tuple[Axes, SubplotSpec]]) -> list[list[float]]:
    """Where they are: a panel of another size may have others, whose labels take another space."""
    return [axis.get_majorticklocs().tolist() for axes, _ in panels for axis in (axes.xaxis, axes.yaxis)]


def _usual(spec: SubplotSpec) -> tuple[float, float, float, float]:
    left, right, above = USUAL
    return left, right, BELOW if spec.is_last_row() else BELOW_INNER, above


def _around(axes: Axes) -> tuple[float, float, float, float]:
    """px that labels, ticks and title take to the left and right of a panel, below and above it."""
    own, everything = axes.get_window_extent(), axes.get_tightbbox(for_layout_only=True)
    if everything is None:  # it is not visible
        return 0.0, 0.0, 0.0, 0.0
    return own.x0 - everything.x0, everything.x1 - own.x1, own.y0 - everything.y0, everything.y1 - own.y1


def _place(panels: list[tuple[Axes, SubplotSpec]], around: FloatArray, size: FloatArray, head: float) -> None:
    """Sizes the panels, with `around` (n, 4) inches around them, so that they fill what is below the head."""
    grid = panels[0][1].get_gridspec()
    margin = np.full((4, max(grid.nrows, grid.ncols)), PAD)
    for (_, spec), needed in zip(panels, around + PAD, strict=True):
        places = spec.colspan.start, spec.colspan.stop - 1, spec.rowspan.stop - 1, spec.rowspan.start
        for side, place in enumerate(places):
            margin[side, place] = max(margin[side, place], needed[side])
    columns = _spans(size[0], margin[LEFT], margin[RIGHT], grid.get_width_ratios(), grid.ncols)
    rows = size[1] - _spans(size[1] - head, margin[TOP], margin[BOTTOM], grid.get_height_ratios(), grid.nrows) - head
    for axes, spec in panels:
        x0, x1 = columns[spec.colspan.start, 0], columns[spec.colspan.stop - 1, 1]
        y0, y1 = rows[spec.rowspan.stop - 1, 1], rows[spec.rowspan.start, 0]
        axes.set_position(Bbox([[x0 / size[0], y0 / size[1]], [x1 / size[0], y1 / size[1]]]))
        axes.apply_aspect()


def _spans(length: float, before: FloatArray, after: FloatArray, ratios: ArrayLike | None, n: int) -> FloatArray:
    """(n, 2) where the panels of each column or row begin and end, inches, with these margins before and after them."""
    share = np.ones(n) if ratios is None else np.asarray(ratios, dtype=np.float64)
    inner = share / share.sum() * max(length - float((before[:n] + after[:n]).sum()), 0.1)
    begin = np.cumsum(before[:n]) + np.concatenate([[0.0], np.cumsum(inner + after[:n])[:-1]])
    return np.stack([begin, begin + inner], axis=1)
