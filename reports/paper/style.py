"""How figures for a paper look: as wide as one column of two, letters of 7 points, lines told apart without colour."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..figures.lettering import plain
from ..figures.palette import TRUTH, colours_of
from .folder import Drawn

COLUMN = 3.5
"""inches: a column of IEEE's and of most others' two"""

STYLE: Mapping[str, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 7,
    "axes.labelsize": 7,
    "axes.titlesize": 7,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "legend.columnspacing": 1.2,
    "legend.borderpad": 0.1,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.xmargin": 0.01,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 0.9,
    "figure.constrained_layout.use": True,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "fgbaseline",
    "savefig.pad_inches": 0.02,
}
MARKS = "os^Dv<P*X>"
MARKED = 8
"""points of a line"""


def in_style() -> AbstractContextManager[None]:
    """What these figures are drawn and written under, whatever the user has set."""
    return style.context(dict(STYLE), after_reset=True)


def line(run: Drawn, name: str, points: int) -> dict[str, Any]:
    """How an estimator's line of so many points is drawn: the reference thick and lowest, the others with marks."""
    look: dict[str, Any] = {
        "color": colours_of(run.names, run.reference)[name],
        "label": plain(name) + (" (reference)" if name == run.reference else ""),
    }
    if name == run.reference:
        return look | {"linewidth": 1.6, "zorder": 2.0}
    others = [n for n in run.names if n != run.reference]
    number, apart = others.index(name), max(1, points // MARKED)
    return look | {
        "linewidth": 0.8,
        "zorder": 2.5,
        "marker": MARKS[number % len(MARKS)],
        "markevery": (apart * number // len(others), apart),
        "markersize": 3.0,
        "markerfacecolor": "white",
        "markeredgewidth": 0.7,
    }


TRUTH_LINE: Mapping[str, Any] = {"color": TRUTH, "linewidth": 2.4, "alpha": 0.6, "zorder": 1.8, "label": "truth"}


def panels(heights: list[float]) -> tuple[Figure, list[Axes]]:
    """A column with panels of these heights (inches) above one another, sharing the abscissa."""
    figure = Figure(figsize=(COLUMN, sum(heights) + 0.55))
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
    return figure, list(axes[:, 0])


def legend(figure: Figure, axes: Axes) -> None:
    """One legend above the panels, in as many rows as the column needs."""
    handles, labels = axes.get_legend_handles_labels()
    rows = -(-sum(len(text) + 8 for text in labels) // 58)
    figure.legend(handles, labels, loc="outside upper left", ncols=-(-len(labels) // max(1, rows)) or 1)
