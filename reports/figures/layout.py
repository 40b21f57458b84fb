"""Layout of a figure: title and legend, then positions, computed once and fixed for every format it is written in.

Panels are placed by matplotlib's constrained layout in closed form, for figures that are one grid of panels below one
legend. That engine measures every tick label and solves repeatedly, which takes most of its time. Here it is done once
at approximate sizes, and again only where that changed the ticks.
Logarithmic axes are labeled with numbers: 0.01, 3, 200, and powers only where these would be long. Lines that coincide
become ribbons, so that all of them show.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from itertools import pairwise
from textwrap import fill
from typing import Any

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

from .style import REFERENCE_ORDER, SCREEN, Style

TITLE_LETTERS = 82
"""characters in a line of a title, which is bold and larger than the legend"""
SAMPLES = 200
"""points of a line that are compared"""
SAME = 1.5
"""px of a PNG: lines nearer than this everywhere coincide"""
STRIPE = 1.4
"""pt, difference in width between a line and the one drawn on it"""
BELOW_REFERENCE = 1.9
"""zorder of what coincides with the reference"""
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


def title_and_legend(figure: Figure, title: str, handles: Iterable[Any] = (), style: Style = SCREEN) -> None:
    """Title on top of a figure (not on paper), in lines, and below it one legend: each label once, in rows.

    Called when the panels are drawn. The title of a panel names the lines that are not seen, as all their values are
    below its logarithmic ordinate. On the screen the lower ones of lines that coincide become wider.
    """
    by_label = {str(handle.get_label()): handle for handle in handles}
    figure.set_label(title)
    if not style.titled and not by_label:
        return
    font = {"weight": "bold", "size": 11.5}
    bold: dict[str, Any] = {"title": fill(title, TITLE_LETTERS), "title_fontproperties": font}
    look = {"borderpad": 0.2, "alignment": "left", **bold} if style.titled else {}
    columns = _legend_columns([len(text) + style.spare for text in by_label], style.letters)
    legend = figure.legend(list(by_label.values()), list(by_label), loc="outside upper left", ncols=columns, **look)
    legend.get_title().set_color("#222222")
    for axes in figure.axes:
        _name_lines_below(axes)
    for axes in figure.axes if style.titled else []:
        _widen_coinciding(axes)


def _name_lines_below(axes: Axes) -> None:
    if axes.get_yscale() != "log":
        return
    below = []
    for line in axes.get_lines():
        y = np.asarray(line.get_ydata(), dtype=np.float64)
        known = y[np.isfinite(y)]
        if not str(line.get_label()).startswith("_") and len(known) and known.max() < axes.get_ylim()[0]:
            below.append(str(line.get_label()))
    if below:
        title = filter(None, [axes.get_title(loc="left"), f"below the axis: {' and '.join(below)}"])
        axes.set_title(", ".join(title), loc="left")


def _legend_columns(widths: Sequence[int], room: int) -> int:
    """Most columns that fit into the room; entries of these widths fill a legend column by column."""
    for columns in range(len(widths), 1, -1):
        each, longer = divmod(len(widths), columns)
        ends = np.cumsum([0] + [each + (i < longer) for i in range(columns)])
        if sum(max(widths[i:j]) for i, j in pairwise(ends.tolist())) <= room:
            return columns
    return 1


def _widen_coinciding(axes: Axes) -> None:
    """Shows coinciding lines as a ribbon: each is wider than the lines drawn on it.

    The reference, the line of REFERENCE_ORDER, lies on the lines that coincide with it, and below all others.
    """
    named = [line for line in axes.get_lines() if not str(line.get_label()).startswith("_")]
    points = {line: np.asarray(line.get_xydata()) for line in named}
    places = {line: axes.transData.transform(at) for line, at in points.items() if len(at) > 2}
    lines = list(places)
    for reference in [line for line in lines if line.get_zorder() == REFERENCE_ORDER]:
        for line in lines:
            if line is not reference and _coincide(places[line], places[reference]):
                line.set_zorder(BELOW_REFERENCE)
    drawn = sorted(lines, key=Line2D.get_zorder)
    for i in reversed(range(len(drawn))):
        above = [on.get_linewidth() for on in drawn[i + 1 :] if _coincide(places[drawn[i]], places[on])]
        drawn[i].set_linewidth(max([drawn[i].get_linewidth(), *(STRIPE + width for width in above)]))


def _coincide(a: FloatArray, b: FloatArray) -> bool:
    """Whether points (n, 2) of two lines, px, are the same; a line without a finite point coincides with none."""
    if len(a) != len(b):
        return False
    some = slice(None, None, max(1, len(a) // SAMPLES))
    known = np.isfinite(a[some]).all(axis=1)
    same_gaps = np.array_equal(known, np.isfinite(b[some]).all(axis=1))
    return bool(same_gaps and known.any() and np.abs(a[some][known] - b[some][known]).max() <= SAME)


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
    left, right, above = DEFAULT_MARGINS
    margins = [(left, right, BELOW if spec.is_last_row() else BELOW_INNER, above) for _, spec in panels]
    _place(panels, np.array(margins), size, head)
    for _ in range(PASSES):
        ticks, own = _ticks(panels), {axes: axes.get_window_extent().frozen() for axes, _ in panels}
        _place(panels, np.array([_outer_margins(axes) for axes, _ in panels]) / figure.dpi, size, head)
        if _ticks(panels) == ticks:
            return own
    return {}


def _ticks(panels: list[tuple[Axes, SubplotSpec]]) -> list[list[float]]:
    """Positions of the major ticks of each axis; they change with the size of a panel, and the labels with them."""
    return [axis.get_majorticklocs().tolist() for axes, _ in panels for axis in (axes.xaxis, axes.yaxis)]


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
        if not super().__call__(x, pos):
            return ""
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
        zero, name = np.zeros(len(at)), f"{axis.axis_name}tick"
        rc: Any = mpl.rcParams
        if axis.axis_name == "x":
            ticks = Line2D(at, zero, transform=axes.get_xaxis_transform(), marker=MarkerStyle(TICKDOWN))
        else:
            ticks = Line2D(zero, at, transform=axes.get_yaxis_transform(), marker=MarkerStyle(TICKLEFT))
        size, width, color = (rc[f"{name}.{key}"] for key in ("minor.size", "minor.width", "color"))
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
