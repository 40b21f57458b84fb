"""The paths from above: each by itself with its landmarks, side by side, and over one another."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fgbaseline.data.plural import plural
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Result, Run

from .lettering import plain
from .palette import LANDMARK, TRUTH, colours
from .style import TRUTH_LINE, WIDTH, head, label, line, note, swatch
from .view import TopView
from .window import Window, common_window, robust_window

ARROWS = 40
"""along a path"""
SURROUNDINGS = (40.0, 0.15)
"""m, and share of the path's extent: landmarks farther from the path's box are not shown"""
SLIMMEST = (0.42, 1.1)
"""height over width of a panel, at least and at most"""


def path_with_landmarks(run: Run, result: Result) -> Figure:
    """The report's own kind of figure: path, start, end, orientation and landmarks of one estimator."""
    view = TopView.of(run.problem)
    path = view.plane(result.estimate.world_T_imu[:, :3, 3])
    landmarks = view.plane(result.estimate.landmarks.position)
    box = robust_window(path) or Window(-np.ones(2), np.ones(2))
    box = _with_landmarks(box, landmarks)
    figure, (axes,) = _panels(box, 1, 1)
    handles = [_draw_landmarks(axes, landmarks)] if len(landmarks) else []
    handles += axes.plot(*path.T, **line(run, result))
    _draw_orientation(axes, view, run, result, path)
    handles += _draw_ends(axes, path)
    _frame(axes, box)
    head(figure, f"{label(run, result.name)}: path from above and landmarks", handles)
    remarks = _outside(box, landmarks, "landmark") + _outside(box, path, "pose")
    if remarks:
        note(axes, " and ".join(remarks) + " outside the picture")
    return figure


def paths_side_by_side(run: Run) -> Figure:
    """A panel for each estimator, all with the same limits, the reference and the truth thin behind each."""
    view, results = TopView.of(run.problem), run.answered
    paths = {result.name: view.plane(result.estimate.world_T_imu[:, :3, 3]) for result in results}
    truth = _truth(run, view)
    box = _padded(common_window(paths.values(), truth))
    columns = {1: 1, 2: 2, 4: 2}.get(len(results), 3)
    figure, panels = _panels(box, -(-len(results) // columns), columns)
    behind: list[Line2D] = []
    for axes, result in zip(panels, results, strict=False):
        landmarks = view.plane(result.estimate.landmarks.position)
        if len(landmarks):
            _draw_landmarks(axes, landmarks[box.holds(landmarks)], size=1.0)
        if truth is not None:
            behind = axes.plot(*truth.T, **{**TRUTH_LINE, "linewidth": 1.1})
        elif run.reference is not None and result.name != run.reference:
            behind = axes.plot(*paths[run.reference].T, **{**line(run, run.results[run.reference]), "linewidth": 0.8})
        axes.plot(*paths[result.name].T, **line(run, result))
        _draw_ends(axes, paths[result.name])
        axes.set_title(f"{label(run, result.name)}{_parting(run, result)}", color=colours(run)[result.name])
        _frame(axes, box, labelled=False)
        outside = _outside(box, paths[result.name], "pose")
        if outside:
            note(axes, outside[0] + " outside")
    for axes in panels[len(results) :]:
        axes.set_visible(False)
    apart = f", and the greatest distance of each from {plain(run.reference)}" if run.reference is not None else ""
    head(figure, f"Paths from above, side by side{apart}", behind)
    return figure


def paths_overlaid(run: Run) -> Figure:
    """All paths in one panel, with the truth where there is one."""
    view, results = TopView.of(run.problem), run.answered
    paths = {result.name: view.plane(result.estimate.world_T_imu[:, :3, 3]) for result in results}
    truth = _truth(run, view)
    box = _padded(common_window(paths.values(), truth))
    figure, (axes,) = _panels(box, 1, 1)
    handles = axes.plot(*truth.T, **TRUTH_LINE) if truth is not None else []
    for result in results:
        path = paths[result.name]
        handles += axes.plot(*path.T, **line(run, result))
        end = path[np.isfinite(path).all(axis=1)][-1:]
        axes.plot(*end.T, "s", color=colours(run)[result.name], markersize=5, zorder=4, clip_on=True)
    if truth is not None:
        axes.plot(*truth[np.isfinite(truth).all(axis=1)][-1:].T, "s", color=TRUTH, markersize=5, zorder=3)
    handles += axes.plot(0.0, 0.0, "o", color="white", markeredgecolor="black", markersize=8, zorder=5, label="start")
    handles.append(swatch("#555555", "end"))
    _frame(axes, box)
    head(figure, "All paths from above", handles)
    remarks = [f"{plain(name)}: {remark}" for name, path in paths.items() for remark in _outside(box, path, "pose")]
    if remarks:
        note(axes, "; ".join(remarks) + " outside the picture")
    return figure


def _truth(run: Run, view: TopView) -> FloatArray | None:
    truth = run.problem.sequence.truth
    return None if truth is None else view.plane(truth.world_T_imu[:, :3, 3])


def _panels(box: Window, rows: int, columns: int) -> tuple[Figure, list[Axes]]:
    """Panels as high as the box asks for, at equal scales."""
    width, height = box.high - box.low
    panel = (WIDTH - 0.7) / columns * height / width
    figure = Figure(figsize=(WIDTH, rows * (panel + 0.25) + 0.95))
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    return figure, list(grid.ravel())


def _frame(axes: Axes, box: Window, *, labelled: bool = True) -> None:
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(box.low[0], box.high[0])
    axes.set_ylim(box.low[1], box.high[1])
    of_start = " of the start" if labelled else ""  # small panels have no room for it
    if labelled or axes.get_subplotspec().is_last_row():  # type: ignore[union-attr]
        axes.set_xlabel(f"ahead{of_start}, m")
    if labelled or axes.get_subplotspec().is_first_col():  # type: ignore[union-attr]
        axes.set_ylabel(f"left{of_start}, m")


def _padded(box: Window) -> Window:
    """The box with a margin, and neither slimmer nor higher than a panel may be."""
    box = box.grown(max(0.04 * box.side, 0.5))
    width, height = box.high - box.low
    missing = np.array([height / SLIMMEST[1] - width, width * SLIMMEST[0] - height]).clip(min=0.0)
    return Window(box.low - 0.5 * missing, box.high + 0.5 * missing)


def _with_landmarks(box: Window, landmarks: FloatArray) -> Window:
    """The path's box, grown to the bulk of the landmarks that lie around it."""
    around = box.grown(max(SURROUNDINGS[0], SURROUNDINGS[1] * box.side))
    near = robust_window(landmarks[around.holds(landmarks)]) if len(landmarks) else None
    if near is not None:
        box = Window(np.minimum(box.low, near.low), np.maximum(box.high, near.high))
    return _padded(box)


def _draw_landmarks(axes: Axes, landmarks: FloatArray, size: float = 3.0) -> Line2D:
    axes.scatter(
        landmarks[:, 0], landmarks[:, 1], s=size, color=LANDMARK, linewidths=0, alpha=0.7, rasterized=True, zorder=1.5
    )
    return swatch(LANDMARK, plural(len(landmarks), "landmark"))


def _draw_orientation(axes: Axes, view: TopView, run: Run, result: Result, path: FloatArray) -> None:
    """Arrows where the camera looks, every so many frames."""
    known = np.flatnonzero(np.isfinite(path).all(axis=1))
    chosen = known[:: max(1, len(known) // ARROWS)]
    looking = view.plane(result.estimate.world_T_imu[chosen, :3, :3] @ run.problem.sequence.imu_T_cam[:3, 2])
    axes.quiver(
        *path[chosen].T,
        *looking.T,
        angles="xy",
        scale=32,
        width=0.0028,
        headwidth=5,
        headlength=6,
        color=colours(run)[result.name],
        alpha=0.75,
        zorder=3,
    )


def _draw_ends(axes: Axes, path: FloatArray) -> list[Line2D]:
    known = path[np.isfinite(path).all(axis=1)]
    style: dict[str, Any] = {"color": "white", "markeredgecolor": "black", "linestyle": "none", "zorder": 5}
    start = axes.plot(*known[:1].T, marker="o", markersize=7, label="start", **style)
    end = axes.plot(*known[-1:].T, marker="s", markersize=6, label="end", **style)
    return [*start, *end]


def _parting(run: Run, result: Result) -> str:
    if result.divergence is None or result.name == run.reference:
        return ""
    return f": {result.divergence['position'].max():.3g} m"


def _outside(box: Window, points: FloatArray, what: str) -> list[str]:
    finite = points[np.isfinite(points).all(axis=1)]
    n = int(np.sum(~box.holds(finite))) if len(finite) else 0
    return [f"{n} {what}{'' if n == 1 else 's'}"] if n else []
