"""The paths from above."""

import numpy as np
from matplotlib.figure import Figure

from fgbaseline.geometry import FloatArray

from ..figures.palette import LANDMARK
from ..figures.window import Window, common_window, robust_window
from .folder import Drawn
from .style import COLUMN, TRUTH_LINE, legend, line

SLIMMEST = (0.35, 1.2)
"""height over width, at least and at most"""


def paths(run: Drawn) -> Figure:
    """All of them, with the truth where there is one."""
    return _map(run, None)


def landmarks(run: Drawn) -> Figure | None:
    """The reference's path and landmarks, or those of the first that has any; None without landmarks."""
    of = run.reference if run.reference in run.landmarks else next(iter(run.landmarks), None)
    return None if of is None else _map(run, of)


def _map(run: Drawn, of: str | None) -> Figure:
    flat = {name: path[:, :2] for name, path in run.paths.items() if of in (None, name)}
    truth = None if run.truth is None else run.truth[:, :2]
    box = common_window(flat.values(), truth)
    points = np.empty((0, 2)) if of is None else run.landmarks[of][:, :2]
    around = robust_window(points[box.grown(max(20.0, 0.15 * box.side)).holds(points)])
    if around is not None:
        box = Window(np.minimum(box.low, around.low), np.maximum(box.high, around.high))
    box = _shaped(box)
    width, height = box.high - box.low
    figure = Figure(figsize=(COLUMN, (COLUMN - 0.5) * height / width + 0.75))
    axes = figure.subplots()
    if len(points):
        x, y = points[box.holds(points)].T
        axes.scatter(x, y, s=0.6, color=LANDMARK, linewidths=0, rasterized=True)
        axes.plot([], [], "s", color=LANDMARK, markersize=3, label="landmarks")
    if truth is not None:
        axes.plot(*truth.T, **TRUTH_LINE)
    for name, path in flat.items():
        axes.plot(*path.T, **line(run, name, len(path)))
    axes.plot(0.0, 0.0, "o", color="white", markeredgecolor="black", markersize=4, zorder=5, label="start")
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(box.low[0], box.high[0]), ylim=(box.low[1], box.high[1]))
    axes.set(xlabel="ahead of the start, m", ylabel="to its left, m")
    legend(figure, axes)
    return figure


def _shaped(box: Window) -> Window:
    """The box with a margin, and neither slimmer nor higher than a column wants it."""
    box = box.grown(max(0.04 * box.side, 0.5))
    width, height = box.high - box.low
    missing: FloatArray = np.array([height / SLIMMEST[1] - width, width * SLIMMEST[0] - height]).clip(min=0.0)
    return Window(box.low - 0.5 * missing, box.high + 0.5 * missing)
