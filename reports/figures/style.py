"""Two styles of all figures, for the screen and for paper: settings, sheets, and the looks of lines."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from typing import Any

from matplotlib import style as rc_style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font

from .palette import GRAY, TRUTH, linestyle

MARKERS = "os^Dv<P*X>"
"""markers of lines on paper, distinguished without color"""
MARKS_PER_LINE = 8
"""marks of a line on paper"""
REFERENCE_ORDER = 2.0
"""zorder of the reference, below the other lines"""
MAX_NAME = 48
"""characters of a name that a figure has room for"""
WHITE: Mapping[str, Any] = {"color": "white", "markeredgecolor": "black", "zorder": 5}
"""marks of a start or an end"""

Line = Callable[[str], Mapping[str, Any]]
"""look of the line of an estimator"""


@dataclass(frozen=True, eq=False, slots=True)
class Style:
    """Settings and measures of one style; lengths are in inches."""

    settings: Mapping[str, Any]
    """matplotlib's rcParams"""
    width: float
    dpi: int
    """resolution of a PNG"""
    room: float
    """height of everything around the panels of a column"""
    letters: int
    """characters in a row of the legend"""
    spare: int
    """letters that the mark of each entry takes"""
    line: float
    """width of an estimator's line, points; the reference's is twice that"""
    truth: Mapping[str, Any]
    """line of the true path"""
    titled: bool
    """whether figures have a title and remarks; a paper has captions for both"""


SHARED: Mapping[str, Any] = {
    "font.family": ["DejaVu Sans"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.xmargin": 0.01,
    "grid.color": "#e4e4e4",
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "fgbaseline",
}
SCREEN = Style(
    settings={
        **SHARED,
        "font.size": 9.5,
        "axes.titlesize": 10,
        "axes.titlelocation": "left",
        "axes.edgecolor": GRAY,
        "axes.labelcolor": "#333333",
        "grid.linewidth": 0.7,
        "xtick.color": GRAY,
        "ytick.color": GRAY,
        "xtick.labelsize": 9,
        "ytick.labelsize": 9,
        "lines.linewidth": 1.4,
        "legend.handlelength": 1.6,
        "figure.dpi": 150,  # so that letters are measured once for layout and PNG
        "path.simplify_threshold": 0.25,
        "agg.path.chunksize": 0,
    },
    width=8.0,  # 1200 px in a PNG, readable at 800
    dpi=150,
    room=1.2,
    letters=92,
    spare=6,
    line=1.3,
    truth={"color": TRUTH, "linewidth": 1.8, "linestyle": (0, (4, 2)), "zorder": 2.2, "label": "truth"},
    titled=True,
)
PAPER = Style(
    settings={
        **SHARED,
        "font.size": 7,
        "axes.titlesize": 7,
        "xtick.labelsize": 6.5,
        "ytick.labelsize": 6.5,
        "legend.fontsize": 6.5,
        "legend.handlelength": 2.2,
        "legend.columnspacing": 1.2,
        "legend.borderpad": 0.1,
        "axes.linewidth": 0.6,
        "grid.linewidth": 0.5,
        "xtick.major.width": 0.6,
        "ytick.major.width": 0.6,
        "lines.linewidth": 0.9,
        "pdf.fonttype": 42,
        "svg.fonttype": "none",
        "savefig.pad_inches": 0.02,
    },
    width=3.5,  # a column of IEEE's and of most others' two
    dpi=300,
    room=0.55,
    letters=58,
    spare=8,
    line=0.8,
    truth={"color": TRUTH, "linewidth": 2.4, "alpha": 0.6, "zorder": 1.8, "label": "truth"},
    titled=False,
)


def in_style(style: Style = SCREEN) -> AbstractContextManager[None]:
    """Context in which figures are drawn and written; the user's own settings hold again after it."""
    return rc_style.context(dict(style.settings), after_reset=True)


def stacked_panels(height: float, rows: int = 1, style: Style = SCREEN, **grid: Any) -> tuple[Figure, list[Axes]]:
    """Empty figure with `rows` panels above one another that share the abscissa."""
    figure = Figure(figsize=(style.width, height))
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False, **grid)
    return figure, list(axes[:, 0])


def lines(style: Style, colors: Mapping[str, str], reference: str | None, names: Sequence[str], points: int) -> Line:
    """Looks of the estimators' lines, the reference below the others and thick.

    On paper the others have marks: `names` are those shown, and each line has so many points.
    """
    others = [name for name in names if name != reference]

    def look(name: str) -> dict[str, Any]:
        color = colors[name]
        base: dict[str, Any] = {"color": color, "linestyle": linestyle(color), "label": label(name, reference)}
        if name == reference:
            return base | {"linewidth": 2.0 * style.line, "zorder": REFERENCE_ORDER}
        base |= {"linewidth": style.line, "zorder": 2.5}
        if style.titled:
            return base
        number, apart = others.index(name), max(1, points // MARKS_PER_LINE)
        return base | {
            "marker": MARKERS[number % len(MARKERS)],
            "markevery": (apart * number // len(others), apart),
            "markersize": 3.0,
            "markerfacecolor": "white",
            "markeredgewidth": 0.7,
        }

    return look


def label(name: str, reference: str | None) -> str:
    """Name of an estimator in a legend."""
    return safe_text(name) + (" (reference)" if name == reference else "")


def safe_text(text: str) -> str:
    """`text` as it can stand in a figure: no mathematics, no line breaks, nothing the font cannot draw, not too long.

    A dollar sign would begin mathematics and a leading underscore would hide a line from the legend.
    """
    known = _drawable()
    letters = "".join(c if ord(c) in known and c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    if len(letters) > MAX_NAME:
        letters = letters[: MAX_NAME - 1] + "…"
    letters = letters.replace("$", r"\$")
    return " " + letters if letters.startswith("_") else letters


@cache
def _drawable() -> frozenset[int]:
    return frozenset(get_font(findfont(FontProperties(family=["DejaVu Sans"]))).get_charmap())
