"""The figure of benchmarks.growth: time above, memory below, against frames, features a frame and landmarks."""

from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from fgbaseline.reports.figures.layout import lay_out, title_and_legend
from fgbaseline.reports.figures.style import ESTIMATOR_COLORS, SCREEN, in_style

from .growth import ESTIMATORS, LEAST_MB, LEAST_SECONDS, Point, exponents, of

ROWS = (("seconds", "processor time, s", LEAST_SECONDS), ("megabytes", "memory beyond the start, MB", LEAST_MB))
DPI = 125
MARKS = dict(zip(ESTIMATORS, "osD^vP", strict=True))


def drawn(points: list[Point]) -> bytes:
    """A PNG: one column for what varies, the exponents of the fits beside the lines' ends."""
    names = list(dict.fromkeys(p.axis for p in points))
    with in_style():
        figure = Figure(figsize=(SCREEN.width, 6.2))
        panels = figure.subplots(len(ROWS), len(names), sharex="col", sharey="row", squeeze=False)
        for row, (unit, title, least) in enumerate(ROWS):
            for column, name in enumerate(names):
                _panel(panels[row, column], points, name, unit, least)
            panels[row, 0].set_ylabel(title)
        for column, name in enumerate(names):
            panels[-1, column].set_xlabel(name)
        title_and_legend(
            figure, "What it costs as the problem grows, with fitted powers", [_handle(name) for name in ESTIMATORS]
        )
        lay_out(figure)
        stream = BytesIO()
        figure.savefig(stream, format="png", dpi=DPI)
    return stream.getvalue()


def _handle(name: str) -> Line2D:
    return Line2D([], [], color=ESTIMATOR_COLORS[name], marker=MARKS[name], markersize=5, label=name)


def _panel(axes: Axes, points: list[Point], axis: str, unit: str, least: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    ends: list[tuple[float, float, str, str]] = []
    for name in ESTIMATORS:
        line = [(p.size, value) for p in of(points, axis, name) if (value := getattr(p, unit)) is not None]
        shown = np.array([(size, max(value, least)) for size, value in line])
        if len(shown) == 0:
            continue
        axes.plot(*shown.T, color=ESTIMATOR_COLORS[name], marker=MARKS[name], markersize=4.5, clip_on=False)
        power = exponents(of(points, axis, name))[unit]
        if np.isfinite(power):
            ends.append((*shown[-1], f"{power:.1f}", ESTIMATOR_COLORS[name]))
    _label(axes, ends)
    for which in (axes.xaxis, axes.yaxis):
        which.set_minor_formatter(NullFormatter())
        which.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_major_locator(FixedLocator(sorted({_round(p.size) for p in points if p.axis == axis})))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_locator(LogLocator(numticks=8))
    axes.set_xmargin(0.12)


def _round(size: float) -> float:
    """To two digits, as a tick has them."""
    return float(f"{size:.2g}")


def _label(axes: Axes, ends: list[tuple[float, float, str, str]]) -> None:
    """The powers right of the lines' ends, pushed apart where they would lie on one another."""
    apart, last = 1.35, 0.0
    for x, y, text, color in sorted(ends, key=lambda end: end[1]):
        place = max(y, last * apart)
        last = place
        axes.annotate(text, (x, place), xytext=(6, 0), textcoords="offset points", va="center", fontsize=8, color=color)
