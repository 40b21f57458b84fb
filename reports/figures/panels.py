"""Building blocks of panels: their limits, series over time and errors with their axes, chi-square bands, remarks.

Limits are robust against a diverged estimate.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import ArrayLike

from fgbaseline import compare
from fgbaseline.compare.column_tables import Columns
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray

from .style import BAND, GRAY, SCREEN, Line, Style, safe_text, stacked_panels

TAIL = 2.0
"""per cent of the points on either side that do not decide how far a cloud reaches"""
DECADES = 1.5
"""spread of the estimators' maxima, in decades, above which an axis is logarithmic"""
DEGREES_OF_FREEDOM = 6.0
"""degrees of freedom of a pose"""
MEDIANS = 100
"""windows of a running median that a line holds"""
COMPONENTS = {
    "position": "position, m",
    "rotation_deg": "rotation, °",
    "along": "ahead, m",
    "across": "to the left, m",
    "up": "above, m",
}
"""columns of `compare.pose_errors`, as the panels have them"""
SIGNED = ("along", "across", "up")


@dataclass(frozen=True, eq=False, slots=True)
class Window:
    """Axis-parallel box: of a plane, or of one axis."""

    low: FloatArray
    high: FloatArray

    @property
    def side(self) -> float:
        """Longer side."""
        return float(np.max(self.high - self.low))

    def grown(self, by: float) -> "Window":
        """Window with a margin of `by` all around."""
        return Window(self.low - by, self.high + by)

    def with_points(self, points: FloatArray, around: float) -> "Window":
        """Window grown to the bulk of those points (n, d) that lie within `around` of it."""
        near = robust_window(points[self.grown(around).holds(points)])
        return self if near is None else Window(np.minimum(self.low, near.low), np.maximum(self.high, near.high))

    def shaped(self, slimmest: tuple[float, float], least: float, share: float = 0.04) -> "Window":
        """Window (of a plane) with a margin, at least `least`, and a height over width within `slimmest`."""
        box = self.grown(max(share * self.side, least))
        width, height = box.high - box.low
        missing = np.array([height / slimmest[1] - width, width * slimmest[0] - height]).clip(min=0.0)
        return Window(box.low - 0.5 * missing, box.high + 0.5 * missing)

    def holds(self, points: FloatArray) -> BoolArray:
        """Mask (n,) of the points (n, d) inside."""
        return np.asarray(((points >= self.low) & (points <= self.high)).all(axis=1), dtype=np.bool_)

    def around(self, points: FloatArray) -> "Window":
        """Box of the points (n, d) inside; the window itself without any."""
        inside = points[self.holds(points)]
        return Window(inside.min(axis=0), inside.max(axis=0)) if len(inside) else self


def known(points: FloatArray) -> FloatArray:
    """Finite ones (m, d) of the points (n, d)."""
    return np.asarray(points[np.isfinite(points).all(axis=1)])


def robust_window(points: FloatArray) -> Window | None:
    """Box of points (n, d), at most half its size beyond the bulk of them; None without a point."""
    finite = known(points)
    if len(finite) == 0:
        return None
    bulk = Window(*np.percentile(finite, [TAIL, 100.0 - TAIL], axis=0))
    return bulk.grown(0.5 * bulk.side + 1e-9).around(finite)


def common_window(paths: Iterable[FloatArray], core: FloatArray | None, least: float = 1.0) -> Window:
    """Box around paths (n, d), of which none may reach farther than its side beyond the box of the core.

    The core is the path to be believed; without one, that of median size. Reaching `least` beyond it is always allowed.
    """
    every = list(paths)
    windows = sorted((w for w in map(robust_window, every) if w is not None), key=lambda w: w.side)
    believed = None if core is None else robust_window(core)
    if believed is None:
        believed = windows[(len(windows) - 1) // 2] if windows else Window(-np.ones(1), np.ones(1))
    points = [known(path) for path in [*every, *([] if core is None else [core])]]
    if not any(map(len, points)):
        return believed
    return believed.grown(max(believed.side, least)).around(np.concatenate(points))


def frame_top_view(axes: Axes, box: Window, x: str = "", y: str = "") -> None:
    """Frames a panel: equal scales, the box and the labels of its axes."""
    (left, bottom), (right, top) = box.low, box.high
    axes.set(aspect="equal", adjustable="box", xlim=(left, right), ylim=(bottom, top), xlabel=x, ylabel=y)


@cache
def chi_square_limits(degrees: float, per: float = 1.0) -> tuple[float, float, float]:
    """Lower 95 % bound, median and upper 95 % bound of chi-square with so many degrees of freedom, over `per`."""
    low, high = compare.chi_square_bounds(degrees)
    return float(low) / per, float(compare.chi_square_quantile(0.5, degrees)) / per, float(high) / per


def median_window(n: int) -> int:
    """Frames of the running median of a line of n frames that jumps from frame to frame: odd, 1 for a short line."""
    return 2 * (n // (2 * MEDIANS)) + 1


def running_median(values: FloatArray) -> FloatArray:
    """Running medians (n,) over `median_window` frames around each value; NaN where all of these are NaN."""
    import pandas as pd

    rolling = pd.Series(values).rolling(median_window(len(values)), center=True, min_periods=1)
    return np.asarray(rolling.median().to_numpy(dtype=np.float64))


def smoothed(n: int) -> str:
    """Remark on a running median over a line of n frames; empty where it is none."""
    return f"running median over {median_window(n)} frames" if median_window(n) > 1 else ""


def plot_series(axes: Axes, t: ArrayLike, series: Mapping[str, FloatArray], line: Line, **look: Any) -> list[Any]:
    """Draws series (T,) over t (T,), each with its line, of which `look` replaces parts; gives the legend's handles."""
    return [handle for name, values in series.items() for handle in axes.plot(t, values, **{**line(name), **look})]


def time_axis(panels: Sequence[Axes], t: FloatArray, style: Style = SCREEN) -> None:
    """Labels the lowest panel and, on the screen, fits all to the recording of times t (T,), s."""
    if style.titled:
        panels[-1].set_xlim(0.0, float(t[-1]))
    panels[-1].set_xlabel("time, s")


def columns(tables: Mapping[str, Columns], column: str) -> dict[str, FloatArray]:
    """Values (n,) of a column of each table."""
    return {name: np.asarray(table[column]) for name, table in tables.items()}


def component_panels(
    tables: Mapping[str, Columns], t: Mapping[str, FloatArray], line: Line, style: Style = SCREEN
) -> tuple[Figure, list[Axes], list[Any]]:
    """Distance, angle and components of errors (see `compare.pose_errors`) over t, by name, and the lines' handles.

    On paper distance and angle alone.
    """
    every = {c: columns(tables, c) for c in COMPONENTS if style.titled or c not in SIGNED}
    shown = {c: series for c, series in every.items() if any(np.isfinite(v).any() for v in series.values())} or every
    ratios = [1.7 if style.titled else 1.0, *[1.0] * (len(shown) - 1)]
    height = 8.6 * sum(ratios) / 5.7 if style.titled else style.room + 0.95 * sum(ratios)
    figure, axes = stacked_panels(height, len(shown), style, height_ratios=ratios)
    handles: list[Any] = []
    for panel, (column, series) in zip(axes, shown.items(), strict=True):
        for name, values in series.items():
            handles += panel.plot(t[name], values, **line(name))
        panel.set_ylabel(COMPONENTS[column])
        if column in SIGNED:
            panel.axhline(0.0, color="#999999", linewidth=0.8, zorder=1.8)
        else:
            fit_log_or_linear(panel, series)
            few_ticks(panel, style)
    return figure, axes, handles


def fit_log_or_linear(axes: Axes, series: Mapping[str, FloatArray]) -> None:
    """Logarithmic ordinate for positive values where the series differ by decades, else a linear one from zero."""
    positive = [v[np.isfinite(v) & (v > 0)] for v in series.values()]
    tops = [float(np.percentile(v, 95)) for v in positive if len(v)]
    if tops and np.log10(max(tops) / min(tops)) > DECADES:
        fit_log(axes, series, decades=4.0)
    elif tops:
        axes.set_ylim(bottom=0.0)


def fit_log(axes: Axes, series: Mapping[str, FloatArray], decades: float = 6.0) -> None:
    """Logarithmic ordinate over the bulk of the positive values, of so many decades at most."""
    positive = np.concatenate([v[np.isfinite(v) & (v > 0)] for v in series.values()] or [np.empty(0)])
    if len(positive) == 0:
        return
    low, high, highest = np.percentile(positive, [2.0, 99.0, 100.0])
    top = min(float(highest), 3.0 * float(high)) * 1.3
    axes.set_yscale("log")
    axes.set_ylim(max(float(low) / 1.5, top * 10.0**-decades), top)


def widen_ordinate(axes: Axes, low: float, high: float) -> None:
    """Widens the ordinate where it does not hold both values."""
    bottom, top = axes.get_ylim()
    axes.set_ylim(min(bottom, low), max(top, high))


def log_where_positive(axes: Axes) -> None:
    """Logarithmic ordinate, unless no line of the panel has anything positive to show on it."""
    values = [np.asarray(line.get_ydata(), dtype=np.float64) for line in axes.get_lines()]
    if any((v[np.isfinite(v)] > 0.0).any() for v in values):
        axes.set_yscale("log")


def few_ticks(axes: Axes, style: Style) -> None:
    """Limits the ticks of a low logarithmic panel: plain numbers at 1, 2, 5 where there are less than two decades.

    Panels are low in a style without titles; others, and linear ones, are left as they are.
    """
    if style.titled or axes.get_yscale() != "log":
        return
    low, high = axes.get_ylim()
    if high < 100.0 * low:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 30.0 * low else (1.0, 3.0), numticks=6))
        axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())


def note_out_of_range(axes: Axes, t: FloatArray, series: Mapping[str, FloatArray], low: float, high: float) -> None:
    """Note of which series (T,), m, go beyond the panel, from when on and how far."""
    leaving = []
    for name, values in series.items():
        beyond = np.flatnonzero((values < low) | (values > high))
        if len(beyond):
            farthest = values[beyond[np.argmax(np.abs(values[beyond]))]]
            text = f"to {farthest:.3g}".replace("-", "\N{MINUS SIGN}")
            leaving.append(f"{safe_text(name)} leaves the panel at {t[beyond[0]]:.1f} s, {text} m")
    if leaving:
        note(axes, "; ".join(leaving))


def chi_square_band(axes: Axes, degrees: float, label: str, *, per: float = 1.0, width: float = 0.9) -> Any:
    """Median and 95 % band of chi-square with so many degrees of freedom, over `per`; gives the band."""
    low, median, high = chi_square_limits(degrees, per)
    axes.axhline(median, color=GRAY, linestyle=":", linewidth=width, zorder=1.5)
    widen_ordinate(axes, 0.7 * low, 1.4 * high)
    return axes.axhspan(low, high, color=BAND, zorder=1, linewidth=0, label=label)


def intervals(
    axes: Axes,
    rows: Iterable[tuple[float, float, float, float, str]],
    size: float,
    width: float,
    cap: Literal["butt", "projecting"] = "butt",
) -> None:
    """Draws a dot and a horizontal interval for each row: ordinate, low end (NaN: none), value, high end, color."""
    for y, low, value, high, color in rows:
        if np.isfinite(low):
            axes.plot([low, high], [y, y], color=color, linewidth=width, solid_capstyle=cap)
        axes.plot([value], [y], marker="o", markersize=size, color=color)
    axes.grid(axis="y", visible=False)


def note(axes: Axes, text: str) -> None:
    """Remark in the lower right corner of a panel."""
    box = {"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.5}
    place: dict[str, Any] = {"transform": axes.transAxes, "ha": "right", "va": "bottom"}
    axes.text(0.995, 0.015, text, **place, fontsize=8.5, color="#444444", zorder=6, bbox=box)


def swatch(color: str, text: str, size: float = 7.0) -> Line2D:
    """Legend's entry for an area or a cloud of points."""
    return Line2D([], [], color=color, marker="s", linestyle="none", markersize=size, label=text)
