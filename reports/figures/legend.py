"""Title and legend of a figure, remarks in its panels, and ribbons of lines that coincide, so that all of them show."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

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
    legend = figure.legend(
        list(by_label.values()),
        list(by_label),
        loc="outside upper left",
        ncols=_legend_columns([len(text) + style.spare for text in by_label], style.letters),
        **({"borderpad": 0.2, "alignment": "left", **bold} if style.titled else {}),
    )
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
    step = max(1, len(a) // SAMPLES)
    apart = np.abs(a[::step] - b[::step]).max(axis=1)
    known = np.isfinite(a[::step]).all(axis=1), np.isfinite(b[::step]).all(axis=1)
    both = known[0] & known[1]
    return bool(both.any() and (known[0] == known[1]).all() and apart[both].max() <= SAME)


def note(axes: Axes, text: str) -> None:
    """Remark in the lower right corner of a panel."""
    box = {"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.5}
    place: dict[str, Any] = {"transform": axes.transAxes, "ha": "right", "va": "bottom"}
    axes.text(0.995, 0.015, text, **place, fontsize=8.5, color="#444444", zorder=6, bbox=box)


def swatch(color: str, text: str, size: float = 7.0) -> Line2D:
    """Legend's entry for an area or a cloud of points."""
    return Line2D([], [], color=color, marker="s", linestyle="none", markersize=size, label=text)
