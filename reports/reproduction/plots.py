"""The report's figures 1 to 9 as it has them: x and y of the world, path red, ends marked, arrows, green landmarks."""

from collections.abc import Sequence as Several
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fgbaseline.data.plural import plural
from fgbaseline.geometry import FloatArray

from ..figures.lettering import plain
from ..figures.style import head, note, swatch
from ..figures.window import Window, robust_window
from .study import Study

PATH, ENDS, ARROW, LANDMARK = "#d62728", "#1f4e9c", "#1f4e9c", "#2ca02c"
ARROWS = 50
"""along a path"""
SIDE, HEAD = 6.4, 1.35
"""inches: how wide a figure is, and how high what stands around its picture"""
AROUND = 0.25
"""of the path's extent: landmarks farther off are counted and not shown"""


def numbered(study: Study) -> dict[str, Figure]:
    """The figures of a recording by name, `figure_01` and so on where the report has them under a number."""
    told, name, label = study.subject.reported, study.subject.name, plain(study.subject.label)
    predicted = study.predicted
    figures = {
        _key(told.path if told else None, name, "path"): plot(
            f"path of the IMU after prediction, {plain(name)}", predicted, told.path if told else None
        ),
        _key(told.arrows if told else None, name, "arrows"): plot(
            f"path of the IMU with orientations, {plain(name)}", predicted, told.arrows if told else None, arrows=True
        ),
    }
    for features, mapped in study.mapped.items():
        number = told.mapped.get(features) if told else None
        landmarks = mapped.estimate.landmarks.position
        title = f"after landmark update, {label}, N = {features}"
        figures[_key(number, name, f"mapped_{features}")] = plot(
            title, mapped.estimate.world_T_imu, number, landmarks=landmarks
        )
    number = told.slam if told else None
    figures[_key(number, name, "slam")] = plot(
        f"visual-inertial SLAM, {label}, N = {study.recorded.features}",
        study.slam.world_T_imu,
        number,
        landmarks=study.slam.landmarks.position,
    )
    return figures


def plot(
    title: str, path: FloatArray, number: int | None, *, arrows: bool = False, landmarks: FloatArray | None = None
) -> Figure:
    """One figure of the report's kind, of a path (T, 4, 4) and landmarks (m, 3) in the world."""
    figure = Figure(figsize=(SIDE, SIDE))
    axes = figure.subplots()
    xy = path[:, :2, 3]
    box = _box(xy)
    handles: list[Any] = []
    if landmarks is not None and len(landmarks):
        points = landmarks[:, :2]
        box = _with(box, points)
        shown = box.holds(points)
        axes.scatter(points[shown, 0], points[shown, 1], s=5, color=LANDMARK, linewidths=0, rasterized=True, zorder=1.5)
        handles.append(swatch(LANDMARK, plural(len(points), "landmark")))
        if not shown.all():
            note(axes, f"{plural(int((~shown).sum()), 'landmark')} outside the picture")
    handles += axes.plot(*xy.T, color=PATH, linewidth=1.4, label="path")
    if arrows:
        _arrows(axes, path)
        handles.append(Line2D([], [], color=ARROW, linewidth=1.4, marker=">", markersize=6, label="x axis of the IMU"))
    known = xy[np.isfinite(xy).all(axis=1)]
    style: dict[str, Any] = {"color": ENDS, "linestyle": "none", "markersize": 7, "zorder": 5}
    handles += axes.plot(*known[:1].T, marker="s", label="start", **style)
    handles += axes.plot(*known[-1:].T, marker="o", label="end", **style)
    width, height = box.high - box.low
    figure.set_size_inches(SIDE, (SIDE - 0.7) * height / width + HEAD)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(box.low[0], box.high[0])
    axes.set_ylim(box.low[1], box.high[1])
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    head(figure, _headline(title, number), handles)
    return figure


def _headline(title: str, number: int | None) -> str:
    """The number of the report's figure and what it shows, in two lines at most."""
    text = f"{title[0].upper()}{title[1:]}" if number is None else f"Figure {number}: {title}"
    return "\n".join(_halves(text))


def _halves(text: str, most: int = 62) -> Several[str]:
    if len(text) <= most:
        return (text,)
    cut = text.rfind(", ", 0, most) + 1
    return (text[:cut], text[cut + 1 :]) if cut > 1 else (text,)


def _key(number: int | None, name: str, what: str) -> str:
    return f"figure_{number:02d}" if number is not None else f"{name}_{what}"


def _arrows(axes: Axes, path: FloatArray) -> None:
    chosen = path[:: max(1, len(path) // ARROWS)]
    pointing = chosen[:, :2, 0]
    pointing = pointing / np.maximum(np.linalg.norm(pointing, axis=1, keepdims=True), 1e-12)
    axes.quiver(
        *chosen[:, :2, 3].T, *pointing.T, angles="xy", scale=24, width=0.004, headwidth=4, color=ARROW, zorder=3
    )


def _box(xy: FloatArray) -> Window:
    box = robust_window(xy) or Window(-np.ones(2), np.ones(2))
    return _square(box.grown(max(0.06 * box.side, 0.5)))


def _with(box: Window, points: FloatArray) -> Window:
    near = robust_window(points[box.grown(AROUND * box.side).holds(points)])
    if near is None:
        return box
    return _square(Window(np.minimum(box.low, near.low), np.maximum(box.high, near.high)))


def _square(box: Window) -> Window:
    """Neither side less than 0.6 of the other."""
    width = box.high - box.low
    missing = np.maximum(0.6 * width[::-1] - width, 0.0)
    return Window(box.low - 0.5 * missing, box.high + 0.5 * missing)
