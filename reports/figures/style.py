"""Looks of all figures: colors and dashes of estimators, and two styles, for the screen and for paper.

An estimator has one color in every figure and on the page. The colors are Okabe and Ito's; lines that color-blind
readers could confuse have different dashes.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from itertools import chain, cycle
from typing import Any

import numpy as np
from matplotlib import style as rc_style
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font

REFERENCE = "#000000"
TRUTH = "#7f7f7f"
LANDMARK = "#5fb98c"

ESTIMATOR_COLORS: Mapping[str, str] = {
    "dead-reckoning": "#0072B2",
    "ekf": "#D55E00",
    "joint-ekf": "#E69F00",
    "isam2": "#882255",
    "isam2-online": "#CC79A7",
    "fixed-lag": "#56B4E9",
    "batch": "#009E73",
    "landmark-mapping": "#B3A100",
}
"""by the name an estimator is registered under; the reference of a run is black instead, whatever its name"""

EXTRA_COLORS = ("#44AA99", "#999933", "#661100", "#6699CC", "#AA4499", "#332288")
"""for estimators of other packages, once the colors are used up that this run leaves"""
DASHED, DASH_DOT, DASH_DOT_DOT = (6.0, 3.0), (8.0, 2.5, 1.5, 2.5), (8.0, 2.0, 1.5, 2.0, 1.5, 2.0)
"""lengths of dashes and gaps, px on the page"""
DASHES: Mapping[str, tuple[float, ...]] = {
    TRUTH: DASHED,
    "#0072B2": DASHED,
    "#CC79A7": DASH_DOT,
    "#B3A100": DASHED,
    "#44AA99": DASH_DOT_DOT,
    "#999933": DASH_DOT,
    "#661100": DASHED,
    "#6699CC": DASHED,
    "#AA4499": DASH_DOT,
    "#332288": DASH_DOT_DOT,
}
"""dashes of the lines of a color, solid without: two colors that color-blind readers may confuse differ in these"""
DARK_GROUND, DARK_INK, DARK_CHROMA = "#1d2126", "#edf0f2", 1.15
"""ground and black ink of a figure on a dark page, and by how much colors are stronger there"""
GREEN, BAND, GRAY = "#6b9a72", "#d7e8d9", "#555555"
"""expected values, the band around them, and marks of no estimator"""
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


def colors(names: Iterable[str], reference: str | None) -> dict[str, str]:
    """Color of each of the names.

    The reference is black, a known name has its own color, and the others take, in their order, those colors that
    none of the names has.
    """
    every = list(names)
    taken = {name: ESTIMATOR_COLORS[name] for name in every if name in ESTIMATOR_COLORS}
    free = [color for color in ESTIMATOR_COLORS.values() if color not in taken.values()]
    rest = chain(free, cycle(EXTRA_COLORS))
    return {name: REFERENCE if name == reference else taken.get(name) or next(rest) for name in every}


def on_dark(color: str) -> str:
    """Color in place of `color` where the ground is dark: as `dark_matrix` makes it of a still figure."""
    matrix = np.array(dark_matrix())
    rgb = np.clip(matrix[:, :3] @ to_rgb(color) + matrix[:, 3], 0.0, 1.0)
    return to_hex((float(rgb[0]), float(rgb[1]), float(rgb[2]))).upper()


@cache
def dark_matrix() -> tuple[tuple[float, ...], ...]:
    """Affine map (3, 4) of sRGB values in [0, 1]: white becomes the dark ground, black light ink, hues stay."""
    luma = np.tile([0.2126, 0.7152, 0.0722], (3, 1))
    ground, ink = np.array(to_rgb(DARK_GROUND)), np.array(to_rgb(DARK_INK))
    linear = DARK_CHROMA * (np.eye(3) - luma) + (ground - ink)[:, None] * luma
    return tuple(tuple(round(float(v), 4) for v in (*row, at)) for row, at in zip(linear, ink, strict=True))


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
        dashes = (0.0, tuple(0.6 * length for length in DASHES[color])) if color in DASHES else "solid"
        base: dict[str, Any] = {"color": color, "linestyle": dashes, "label": label(name, reference)}
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
