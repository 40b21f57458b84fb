"""Building blocks of panels: series over time with their axes, chi-square bands, intervals, medians by depth."""

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import ArrayLike

from fgbaseline import compare
from fgbaseline.geometry import FloatArray

from .legend import note
from .palette import BAND, GRAY
from .style import Line, Style, safe_text

DECADES = 1.5
"""spread of the estimators' maxima, in decades, above which an axis is logarithmic"""
DEGREES_OF_FREEDOM = 6.0
"""degrees of freedom of a pose"""
CONSISTENT = "95 % if consistent (dotted: median)"
MEDIANS = 100
"""windows of a running median that a line holds"""


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


def fit_log_or_linear(axes: Axes, series: Mapping[str, FloatArray]) -> None:
    """Logarithmic ordinate for positive values where the series differ by decades, else a linear one from zero."""
    reach = {name: v[np.isfinite(v) & (v > 0)] for name, v in series.items()}
    tops = [float(np.percentile(v, 95)) for v in reach.values() if len(v)]
    if not tops:
        return
    if np.log10(max(tops) / min(tops)) > DECADES:
        fit_log(axes, series, decades=4.0)
    else:
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


def fit_signed(axes: Axes, t: FloatArray, series: Mapping[str, FloatArray], reach: float) -> None:
    """Linear ordinate out to `reach` on either side, with a note of which series (T,) leave it and when."""
    values = np.concatenate([v[np.isfinite(v)] for v in series.values()] or [np.empty(0)])
    low, high = (float(values.min()), float(values.max())) if len(values) else (-reach, reach)
    low, high = max(low, -reach), min(high, reach)
    margin = max(0.06 * (high - low), 1e-9)
    axes.set_ylim(low - margin, high + margin)
    note_out_of_range(axes, t, series, -reach, reach)


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
    bottom, top = axes.get_ylim()
    axes.set_ylim(min(bottom, 0.7 * low), max(top, 1.4 * high))
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


def short(text: str) -> str:
    """Name of a class as a tick has room for it: `5 to 10 m` is 5–10 m."""
    return text.replace(" and more", "+").replace(" to ", "–")
