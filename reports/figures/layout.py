"""Layout of a figure: computed once, then fixed for every format it is written in.

Panels are placed by matplotlib's constrained layout in closed form, for figures that are one grid of panels below one
legend. That engine measures every tick label and solves repeatedly, which takes most of its time. Here it is done once
at approximate sizes, and again only where that changed the ticks.
Logarithmic axes are labeled with numbers: 0.01, 3, 200, and powers only where these would be long.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT, MarkerStyle
from matplotlib.ticker import LogFormatter, LogFormatterSciNotation, NullLocator
from matplotlib.transforms import Bbox, blended_transform_factory
from numpy.typing import ArrayLike

from fgbaseline.geometry import FloatArray

PAD = 0.042
"""inches around each panel with its labels, and around the legend"""
DEFAULT_MARGINS = (0.6, 0.12, 0.25)
"""inches to the left and right of a panel and above it, by which it is sized before anything is measured"""
BELOW, BELOW_INNER = 0.5, 0.1
"""inches under a panel of the lowest row, and of those above"""
PASSES = 3
"""at most, of measuring and placing; a second one is needed where a panel has other ticks at its new size"""
LEFT, RIGHT, BOTTOM, TOP = range(4)
LONG = (1e-4, 1e5)
"""an axis that reaches beyond these is labeled with powers of ten"""
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def lay_out(figure: Figure) -> None:
    """Places panels, titles and the labels of axes at fixed, round positions.

    Every drawing would otherwise ask all tick labels of all panels again where a title or a label has room.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            label_with_numbers(axis)
        axes.set_title(axes.get_title(loc="left"), loc="left", y=1.0)
    draw_minor_ticks_at_once(figure.axes)
    measured = fill_grid(figure)
    # "none" would leave a layout engine that does nothing, but for which every figure is drawn twice
    with without_layout_engine():
        figure.set_layout_engine(None)
    for axes in figure.axes:
        axes.set_position(Bbox(np.round(axes.get_position(original=True).get_points(), 4)))
        axes.apply_aspect()
    _fix_labels(figure, measured)


def without_layout_engine() -> AbstractContextManager[None]:
    """Context in which saving a figure adds no layout engine."""
    return mpl.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False})


def _fix_labels(figure: Figure, measured: Mapping[Axes, Bbox]) -> None:
    """Labels stay where they are, those of the ordinates of a column of panels in one line.

    Labels of panels that were `measured` have moved with them since, those of others are measured here.
    """
    inches = figure.dpi_scale_trans
    columns: dict[int, list[tuple[Axes, float]]] = defaultdict(list)
    for axes in figure.axes:
        moved = np.subtract(axes.get_window_extent().min, measured[axes].min) if axes in measured else np.zeros(2)
        if axes.xaxis.label.get_text():
            if axes not in measured:
                axes.xaxis.get_tightbbox()
            down = round((axes.xaxis.label.get_position()[1] + moved[1]) / figure.dpi, 3)
            axes.xaxis.set_label_coords(0.5, down, blended_transform_factory(axes.transAxes, inches))
        if axes.yaxis.label.get_text():
            if axes not in measured:
                axes.yaxis.get_tightbbox()
            place = axes.get_subplotspec()
            column = -1 - len(columns) if place is None else place.colspan.start
            columns[column].append((axes, (axes.yaxis.label.get_position()[0] + moved[0]) / figure.dpi))
    for panels in columns.values():
        left = round(min(x for _, x in panels), 3)
        for axes, _ in panels:
            axes.yaxis.set_label_coords(left, 0.5, blended_transform_factory(inches, axes.transAxes))


def fill_grid(figure: Figure) -> dict[Axes, Bbox]:
    """Places the panels of a figure that are in a grid (the same for all of them), below its legends.

    Returns where each panel was, px, when it was measured with the ticks that it has now.
    """
    panels = [(axes, spec) for axes in figure.axes if (spec := axes.get_subplotspec()) is not None]
    if not panels:
        return {}
    FigureCanvasAgg(figure)  # measures without drawing
    size = figure.get_size_inches()
    head = max((legend.get_window_extent().height / figure.dpi + 2.0 * PAD for legend in figure.legends), default=0.0)
    _place(panels, np.array([_default_margins(spec) for _, spec in panels]), size, head)
    for _ in range(PASSES):
        ticks, own = _ticks(panels), {axes: axes.get_window_extent().frozen() for axes, _ in panels}
        _place(panels, np.array([_outer_margins(axes) for axes, _ in panels]) / figure.dpi, size, head)
        if _ticks(panels) == ticks:
            return own
    return {}


def _ticks(panels: list[tuple[Axes, SubplotSpec]]) -> list[list[float]]:
    """Positions of the major ticks of each axis; they change with the size of a panel, and the labels with them."""
    return [axis.get_majorticklocs().tolist() for axes, _ in panels for axis in (axes.xaxis, axes.yaxis)]


def _default_margins(spec: SubplotSpec) -> tuple[float, float, float, float]:
    left, right, above = DEFAULT_MARGINS
    return left, right, BELOW if spec.is_last_row() else BELOW_INNER, above


def _outer_margins(axes: Axes) -> tuple[float, float, float, float]:
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
    """Begin and end (n, 2), inches, of the panels of each column or row, with these margins around them."""
    share = np.ones(n) if ratios is None else np.asarray(ratios, dtype=np.float64)
    inner = share / share.sum() * max(length - float((before[:n] + after[:n]).sum()), 0.1)
    begin = np.cumsum(before[:n]) + np.concatenate([[0.0], np.cumsum(inner + after[:n])[:-1]])
    return np.stack([begin, begin + inner], axis=1)


class Numbers(LogFormatter):
    """Labels of the ticks that matplotlib chooses, without its mathematical text, which is slow to lay out."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of the tick at x; empty where it has none."""
        return self._number(x) if super().__call__(x, pos) else ""

    def _number(self, x: float) -> str:
        low, high = sorted(self.axis.get_view_interval())  # type: ignore[union-attr]
        if LONG[0] <= low and high <= LONG[1]:
            return f"{x:g}"
        mantissa, _, exponent = f"{x:e}".partition("e")
        power = f"10{str(int(exponent)).translate(SUPERSCRIPTS)}"
        return power if float(mantissa) == 1.0 else f"{float(mantissa):g}×{power}"


def label_with_numbers(axis: Axis) -> None:
    """Labels a logarithmic axis, once its limits are final, unless it was given labels of its own."""
    if not isinstance(axis.get_major_formatter(), LogFormatterSciNotation):
        return
    axis.set_major_formatter(Numbers())
    if isinstance(axis.get_minor_formatter(), LogFormatterSciNotation):
        axis.set_minor_formatter(Numbers(labelOnlyBase=False))
    if not any(axis.get_minor_formatter().format_ticks(list(axis.get_minorticklocs()))):
        axis.set_tick_params(which="minor", labelleft=False, labelbottom=False)


def draw_minor_ticks_at_once(panels: Iterable[Axes]) -> None:
    """Makes one line of the minor ticks of each logarithmic axis, once its limits are final, unless some have labels.

    As ticks each is five artists, which are measured and drawn in every form whether they show or not.
    """
    bare = [(axes, axis, _unlabeled(axis)) for axes in panels for axis in (axes.xaxis, axes.yaxis)]
    for axes, axis, at in bare:  # read before any is changed: panels that share an axis share its locator
        if len(at) == 0:
            continue
        axis.set_minor_locator(NullLocator())
        zero, rc = np.zeros(len(at)), mpl.rcParams
        if axis.axis_name == "x":
            ticks = Line2D(at, zero, transform=axes.get_xaxis_transform(), marker=MarkerStyle(TICKDOWN))
            size, width, color = rc["xtick.minor.size"], rc["xtick.minor.width"], rc["xtick.color"]
        else:
            ticks = Line2D(zero, at, transform=axes.get_yaxis_transform(), marker=MarkerStyle(TICKLEFT))
            size, width, color = rc["ytick.minor.size"], rc["ytick.minor.width"], rc["ytick.color"]
        ticks.set(markersize=size, markeredgewidth=width, color=color, linestyle="none", clip_on=False)
        ticks.set_in_layout(False)
        axes.add_artist(ticks)


def _unlabeled(axis: Axis) -> FloatArray:
    """Positions (n,) of the minor ticks of a logarithmic axis; empty if one of them has a label."""
    if axis.get_scale() != "log":
        return np.empty(0)
    low, high = sorted(axis.get_view_interval())
    at = np.asarray(axis.get_minorticklocs(), dtype=np.float64)
    at = at[(at >= low) & (at <= high)]
    return np.empty(0) if any(axis.get_minor_formatter().format_ticks(at.tolist())) else at
