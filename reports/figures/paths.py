"""Paths from above: over one another, side by side, and each with its landmarks; and their height over time."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fgbaseline.data.top_view import TopView
from fgbaseline.data.wording import distance, plural
from fgbaseline.geometry import FloatArray

from .layout import title_and_legend
from .panels import (
    Window,
    common_window,
    frame_top_view,
    known,
    note,
    note_out_of_range,
    plot_series,
    robust_window,
    swatch,
    time_axis,
)
from .run_data import RunData
from .style import GRAY, LANDMARK, SCREEN, TRUTH, WHITE, Line, Style, label, safe_text, stacked_panels

ARROWS = 40
"""along a path"""
SURROUNDINGS = (40.0, 0.15)
"""m, and share of the path's extent: landmarks farther from the path's box are not shown"""
ASPECT = (0.42, 1.1)
"""height over width of a panel, at least and at most"""
PAPER_ASPECT, PAPER_SURROUNDINGS = (0.35, 1.2), (20.0, 0.15)
MIN_MARGIN = 0.5
"""m of a margin, at least"""
MIN_HEIGHT_RANGE = 0.1
"""height over extent, up to which any path is shown"""


def paths_overlaid(run: RunData, style: Style = SCREEN) -> Figure:
    """All paths in one panel, with ground truth where there is one."""
    if style is not SCREEN:
        return _paper_paths(run, style, run.names)
    paths, truth = _flat(run)
    box = common_window(paths.values(), truth).shaped(ASPECT, MIN_MARGIN)
    figure, (axes,) = _panels(box, 1, 1)
    handles = overlaid(axes, paths, run.line(), style, truth)
    frame_top_view(axes, box, "ahead of the start, m", "left of the start, m")
    title_and_legend(figure, "All trajectories from above", handles)
    remarks = [f"{safe_text(name)}: {remark}" for name, path in paths.items() for remark in _outside(box, path, "pose")]
    if remarks:
        note(axes, "; ".join(remarks) + " outside the panel")
    return figure


def overlaid(
    axes: Axes,
    paths: Mapping[str, FloatArray],
    line: Line,
    style: Style,
    truth: FloatArray | None = None,
    start: str = "start",
) -> list[Any]:
    """Draws paths (n, 2) from a common start, which is named, and on the screen their ends; gives the handles."""
    handles = axes.plot(*truth.T, **style.truth) if truth is not None else []
    for name, path in paths.items():
        handles += axes.plot(*path.T, **line(name))
    for name, path in paths.items() if style.titled else ():
        axes.plot(*known(path)[-1:].T, "s", color=line(name)["color"], markersize=5, zorder=4)
    if truth is not None and style.titled:
        axes.plot(*known(truth)[-1:].T, "s", color=TRUTH, markersize=5, zorder=3)
    handles += axes.plot(0.0, 0.0, "o", markersize=8 if style.titled else 4, label=start, **WHITE)
    return [*handles, swatch(GRAY, "end")] if style.titled else handles


def estimator_with_landmarks(run: RunData) -> str | None:
    """Estimator whose landmarks a paper shows: the reference, or the first that has any; None without landmarks."""
    return run.reference if run.reference in run.landmarks else next(iter(run.landmarks), None)


def path_with_landmarks(run: RunData, name: str | None, style: Style = SCREEN) -> Figure | None:
    """Path of one estimator with start, end, orientation and landmarks; None without an estimator."""
    if name is None:
        return None
    if style is not SCREEN:
        return _paper_paths(run, style, (name,), run.landmarks[name][:, :2])
    path, landmarks = run.paths[name][:, :2], run.landmarks.get(name, np.empty((0, 3)))[:, :2]
    box = robust_window(path) or Window(-np.ones(2), np.ones(2))
    box = box.with_points(landmarks, max(SURROUNDINGS[0], SURROUNDINGS[1] * box.side)).shaped(ASPECT, MIN_MARGIN)
    figure, (axes,) = _panels(box, 1, 1)
    handles = [_draw_landmarks(axes, landmarks)] if len(landmarks) else []
    handles += axes.plot(*path.T, **run.line()(name))
    if run.run is not None:
        problem, world_R_imu = run.run.problem, run.run.results[name].estimate.world_T_imu[:, :3, :3]
        optical_axis = TopView.of(problem).plane(world_R_imu @ problem.sequence.imu_T_cam[:3, 2])
        handles.append(_draw_orientation(axes, path, optical_axis, run.colors[name]))
    handles += _draw_ends(axes, path)
    frame_top_view(axes, box, "ahead of the start, m", "left of the start, m")
    title_and_legend(figure, f"{label(name, run.reference)}: trajectory from above and landmarks", handles)
    remarks = _outside(box, landmarks, "landmark") + _outside(box, path, "pose")
    if remarks:
        note(axes, " and ".join(remarks) + " outside the panel")
    return figure


def paths_side_by_side(run: RunData) -> Figure:
    """A panel for each estimator, all with the same limits, the reference and ground truth thin behind each."""
    paths, truth = _flat(run)
    box = common_window(paths.values(), truth).shaped(ASPECT, MIN_MARGIN)
    columns = {1: 1, 2: 2, 4: 2}.get(len(paths), 3)
    figure, panels = _panels(box, -(-len(paths) // columns), columns)
    line = run.line()
    behind: list[Line2D] = []
    ends: list[Line2D] = []
    for axes, (name, path) in zip(panels, paths.items(), strict=False):
        if name in run.landmarks:
            landmarks = run.landmarks[name][:, :2]
            _draw_landmarks(axes, landmarks[box.holds(landmarks)], size=1.0)
        if truth is not None:
            behind = axes.plot(*truth.T, **{**SCREEN.truth, "linewidth": 1.1})
        elif run.reference is not None and name != run.reference:
            behind = axes.plot(*paths[run.reference].T, **{**line(run.reference), "linewidth": 0.8})
        axes.plot(*path.T, **line(name))
        ends = _draw_ends(axes, path)
        axes.set_title(f"{label(name, run.reference)}{_divergence(run, name)}", color=run.colors[name])
        place = axes.get_subplotspec()
        assert place is not None
        frame_top_view(axes, box, "ahead, m" if place.is_last_row() else "", "left, m" if place.is_first_col() else "")
        outside = _outside(box, path, "pose")
        if outside:
            note(axes, outside[0] + " outside")
    for axes in panels[len(paths) :]:
        axes.set_visible(False)
    apart = f", and the greatest distance of each from {safe_text(run.reference)}" if run.reference is not None else ""
    title_and_legend(figure, f"Trajectories from above, side by side{apart}", [*behind, *ends])
    return figure


def height(run: RunData) -> Figure:
    """Height above the start over time."""
    heights = {name: path[:, 2] for name, path in run.paths.items()}
    true = None if run.truth is None else run.truth[:, 2]
    figure, (axes,) = stacked_panels(3.4)
    handles = axes.plot(run.t, true, **SCREEN.truth) if true is not None else []
    handles += plot_series(axes, run.t, heights, run.line())
    least = MIN_HEIGHT_RANGE * common_window(run.paths.values(), run.truth).side
    box = common_window([h[:, None] for h in heights.values()], None if true is None else true[:, None], least)
    box = box.grown(0.06 * box.side + 0.05)
    low, high = float(box.low[0]), float(box.high[0])
    axes.set(ylim=(low, high), ylabel="height, m")
    note_out_of_range(axes, run.t, heights, low, high)
    time_axis([axes], run.t)
    title_and_legend(figure, "Height above the start", handles)
    return figure


def _paper_paths(run: RunData, style: Style, names: tuple[str, ...], points: FloatArray | None = None) -> Figure:
    """Paths and landmarks (m, 2) in one column, without marks that a caption explains."""
    paths, truth = _flat(run)
    paths = {name: paths[name] for name in names}
    box = common_window(paths.values(), truth)
    if points is not None:
        box = box.with_points(points, max(PAPER_SURROUNDINGS[0], PAPER_SURROUNDINGS[1] * box.side))
    box = box.shaped(PAPER_ASPECT, MIN_MARGIN)
    width, height = box.high - box.low
    figure = Figure(figsize=(style.width, (style.width - 0.5) * height / width + 0.75))
    axes = figure.subplots()
    handles: list[Any] = []
    if points is not None:
        x, y = points[box.holds(points)].T
        axes.scatter(x, y, s=0.6, color=LANDMARK, linewidths=0, rasterized=True)
        handles.append(swatch(LANDMARK, "landmarks", 3.0))
    handles += overlaid(axes, paths, run.line(style), style, truth)
    frame_top_view(axes, box, "ahead of the start, m", "to its left, m")
    title_and_legend(figure, "", handles, style)
    return figure


def _flat(run: RunData) -> tuple[dict[str, FloatArray], FloatArray | None]:
    """Paths (T, 2) of the estimators and of the truth, from above."""
    return {name: path[:, :2] for name, path in run.paths.items()}, None if run.truth is None else run.truth[:, :2]


def _panels(box: Window, rows: int, columns: int) -> tuple[Figure, list[Axes]]:
    """Panels as high as the box asks for, at equal scales."""
    width, height = box.high - box.low
    panel = (SCREEN.width - 0.7) / columns * height / width
    figure = Figure(figsize=(SCREEN.width, rows * (panel + 0.25) + 0.95))
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    return figure, list(grid.ravel())


def _draw_landmarks(axes: Axes, landmarks: FloatArray, size: float = 3.0) -> Line2D:
    x, y = landmarks.T
    axes.scatter(x, y, s=size, color=LANDMARK, linewidths=0, alpha=0.7, rasterized=True, zorder=1.5)
    return swatch(LANDMARK, plural(len(landmarks), "landmark"))


def _draw_orientation(axes: Axes, path: FloatArray, directions: FloatArray, color: str) -> Line2D:
    """Arrows along the optical axis (T, 2), at some of the frames, and their entry in the legend."""
    there = np.flatnonzero(np.isfinite(path).all(axis=1))
    chosen = there[:: max(1, len(there) // ARROWS)]
    look: dict[str, Any] = {"scale": 32, "width": 0.0028, "headwidth": 5, "headlength": 6, "alpha": 0.75, "zorder": 3}
    axes.quiver(*path[chosen].T, *directions[chosen].T, angles="xy", color=color, **look)
    return Line2D([], [], color=color, marker="$\\rightarrow$", linestyle="none", markersize=9, label="optical axis")


def _draw_ends(axes: Axes, path: FloatArray) -> list[Line2D]:
    there = known(path)
    start = axes.plot(*there[:1].T, marker="o", markersize=7, label="start", linestyle="none", **WHITE)
    end = axes.plot(*there[-1:].T, marker="s", markersize=6, label="end", linestyle="none", **WHITE)
    return [*start, *end]


def _divergence(run: RunData, name: str) -> str:
    series = run.series[name]
    if name == run.reference or "divergence_position" not in series:
        return ""
    return f": {distance(float(series['divergence_position'].max()))}"


def _outside(box: Window, points: FloatArray, what: str) -> list[str]:
    finite = known(points)
    n = int(np.sum(~box.holds(finite))) if len(finite) else 0
    return [plural(n, what)] if n else []
