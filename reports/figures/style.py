"""How all figures look: sheet, line, legend and note."""

from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from typing import Any

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fgbaseline.reports.comparison import Result, Run

from .lettering import plain
from .palette import TRUTH, colours

WIDTH = 8.0
"""inches: 1200 px in a PNG, readable at 800"""
DPI = 150
"""of a PNG"""
LETTERS_IN_A_ROW = 92
"""that a legend has room for, with six to spare for each mark"""

STYLE: Mapping[str, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.labelcolor": "#333333",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.xmargin": 0.01,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.fontsize": 9.5,
    "legend.handlelength": 1.6,
    "figure.dpi": DPI,  # so that letters are measured once for layout and PNG
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.constrained_layout.use": True,
    "svg.fonttype": "path",
    "svg.hashsalt": "fgbaseline",
    "path.simplify_threshold": 0.25,
    "agg.path.chunksize": 0,
}


def in_style() -> AbstractContextManager[None]:
    """What figures are drawn and written under; whatever the user has set for figures of their own is left alone."""
    return style.context(dict(STYLE), after_reset=True)


def sheet(height: float, rows: int = 1, **grid: Any) -> tuple[Figure, list[Axes]]:
    """An empty figure with `rows` panels above one another that share the abscissa."""
    figure = Figure(figsize=(WIDTH, height))
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False, **grid)
    return figure, list(axes[:, 0])


def head(figure: Figure, title: str, handles: Iterable[Any] = ()) -> None:
    """The finding, or the quantity, on top of a figure, and below it one legend: each label once, in rows."""
    by_label = {str(handle.get_label()): handle for handle in handles}
    letters = sum(len(text) + 6 for text in by_label)
    rows = -(-letters // LETTERS_IN_A_ROW)
    legend = figure.legend(
        list(by_label.values()),
        list(by_label),
        loc="outside upper left",
        ncols=-(-len(by_label) // max(1, rows)) or 1,
        borderpad=0.2,
        alignment="left",
        title=title,
        title_fontproperties={"weight": "bold", "size": 11.5},
    )
    legend.get_title().set_color("#222222")
    figure.set_label(title)


def line(run: Run, result: Result) -> dict[str, Any]:
    """How the line of an estimator is drawn: the reference lies below the others, and shows beside them."""
    is_reference = result.name == run.reference
    return {
        "color": colours(run)[result.name],
        "linewidth": 2.6 if is_reference else 1.3,
        "zorder": 2.0 if is_reference else 2.5,
        "label": label(run, result.name),
    }


TRUTH_LINE: Mapping[str, Any] = {
    "color": TRUTH,
    "linewidth": 1.8,
    "linestyle": (0, (4, 2)),
    "zorder": 2.2,
    "label": "truth",
}


def label(run: Run, name: str) -> str:
    """The name of an estimator as a legend has it."""
    return plain(name) + (" (reference)" if name == run.reference else "")


def note(axes: Axes, text: str) -> None:
    """A remark in the lower right corner of a panel."""
    axes.text(
        0.995,
        0.015,
        text,
        transform=axes.transAxes,
        ha="right",
        va="bottom",
        fontsize=8.5,
        color="#444444",
        zorder=6,
        bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.5},
    )


def swatch(colour: str, text: str) -> Line2D:
    """A legend's entry for an area or a cloud of points."""
    return Line2D([], [], color=colour, marker="s", linestyle="none", markersize=7, label=text)
