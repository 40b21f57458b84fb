"""Panels over time: the abscissa that all figures by frame share."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Run

from .lettering import plain
from .style import note

DECADES = 1.5
"""between what the estimators reach, from which on an axis is logarithmic"""


def seconds(run: Run) -> FloatArray:
    """(T,) time since the first frame, s."""
    t = run.problem.sequence.t
    return np.asarray(t - t[0], dtype=np.float64)


def time_axis(run: Run, axes: list[Axes]) -> None:
    """Labels the lowest panel and fits all to the recording."""
    t = seconds(run)
    axes[-1].set_xlim(0.0, float(t[-1]))
    axes[-1].set_xlabel("time, s")


def fit_log_or_linear(axes: Axes, series: Mapping[str, FloatArray]) -> None:
    """A logarithmic ordinate for positive values where the series differ by decades, else a linear one from zero."""
    reach = {name: v[np.isfinite(v) & (v > 0)] for name, v in series.items()}
    tops = [float(np.percentile(v, 95)) for v in reach.values() if len(v)]
    if not tops:
        return
    if np.log10(max(tops) / min(tops)) > DECADES:
        fit_log(axes, series, decades=4.0)
    else:
        axes.set_ylim(bottom=0.0)


def fit_log(axes: Axes, series: Mapping[str, FloatArray], decades: float = 6.0) -> None:
    """A logarithmic ordinate over the bulk of the positive values, of so many decades at most."""
    positive = np.concatenate([v[np.isfinite(v) & (v > 0)] for v in series.values()] or [np.empty(0)])
    if len(positive) == 0:
        return
    low, high, highest = np.percentile(positive, [2.0, 99.0, 100.0])
    top = min(float(highest), 3.0 * float(high)) * 1.3
    axes.set_yscale("log")
    axes.set_ylim(max(float(low) / 1.5, top * 10.0**-decades), top)


def log_where_positive(axes: Axes) -> None:
    """A logarithmic ordinate, unless no line of the panel has anything positive to show on it."""
    values = [np.asarray(line.get_ydata(), dtype=np.float64) for line in axes.get_lines()]
    if any((v[np.isfinite(v)] > 0.0).any() for v in values):
        axes.set_yscale("log")


def fit_signed(run: Run, axes: Axes, series: Mapping[str, FloatArray], reach: float) -> None:
    """A linear ordinate out to `reach` on either side, with a note of who leaves it and when."""
    values = np.concatenate([v[np.isfinite(v)] for v in series.values()] or [np.empty(0)])
    low, high = (float(values.min()), float(values.max())) if len(values) else (-reach, reach)
    low, high = max(low, -reach), min(high, reach)
    margin = max(0.06 * (high - low), 1e-9)
    axes.set_ylim(low - margin, high + margin)
    note_leaving(axes, seconds(run), series, -reach, reach)


def note_leaving(axes: Axes, t: FloatArray, series: Mapping[str, FloatArray], low: float, high: float) -> None:
    """A note of which series (T,), m, go beyond the panel, from when on and how far."""
    leaving = []
    for name, values in series.items():
        beyond = np.flatnonzero((values < low) | (values > high))
        if len(beyond):
            farthest = values[beyond[np.argmax(np.abs(values[beyond]))]]
            leaving.append(f"{plain(name)} leaves the panel at {t[beyond[0]]:.1f} s, {_signed(farthest)} m")
    if leaving:
        note(axes, "; ".join(leaving))


def _signed(value: float) -> str:
    return f"to {value:.3g}".replace("-", "\N{MINUS SIGN}")
