"""Figures of a reproduction: figures 1 to 9 of the source paper, the sweep over features and noise, and the causes.

The source paper's figures show x and y of the world, the path red, its ends marked, arrows, and green landmarks.
"""

from collections.abc import Sequence as Several
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from fgbaseline.data import Status
from fgbaseline.data.top_view import TopView
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.path_length import path_length

from ..figures.drawing import DrawOne, drawn
from ..figures.layout import title_and_legend
from ..figures.panels import Window, common_window, frame_top_view, known, note, robust_window, swatch
from ..figures.style import SCREEN, safe_text
from ..formatting import meters

if TYPE_CHECKING:
    from fgbaseline.reports.reproduction.experiments import Outcome, Study

PATH, ENDS, ARROW, LANDMARK = "#d62728", "#1f4e9c", "#1f4e9c", "#2ca02c"
DEAD_RECKONING, BROKEN = "#444444", "#b3261e"
ARROWS = 50
"""along a path"""
SIDE, HEAD = 6.4, 1.35
"""inches: width of a figure as in the source paper, and height of everything around its picture"""
AROUND = 0.25
"""share of the path's extent: landmarks farther off are counted and not shown"""
SQUARE = (0.6, 1.0 / 0.6)
"""height over width of a picture as in the source paper, at least and at most"""
COLUMNS = 2
MARGIN = 1.1
"""factor on the largest box: all stages have one scale"""
STAGE_ASPECT = 0.3
"""height over width of the panel of a stage, at least"""
COLORS = colormaps["cividis_r"]
LEAST, MOST = 1e-3, 1.0
"""shares of the path's length between which the color goes"""
MAP_ROW, BAR = 0.42, 0.24
"""inches for a row of the map and for a bar"""
ROOM = 0.95
"""inches for everything around a panel"""


def draw(studies: Several["Study"]) -> dict[str, Figure]:
    """The source paper's figures by number, those of other recordings by name, then `sweep` and `causes_NAME`."""
    every: dict[str, DrawOne] = {}
    for study in studies:
        every |= numbered(study)
    in_report = sorted(name for name in every if name.startswith("figure_"))
    figures = {name: every[name] for name in [*in_report, *every]}
    figures["sweep"] = partial(sweep_figure, studies)
    return drawn(figures | {f"causes_{study.subject.name}": partial(stages_figure, study) for study in studies})


def numbered(study: "Study") -> dict[str, DrawOne]:
    """Figures of a recording by name, `figure_01` and so on where the report has them under a number."""
    paper, name, label = study.subject.paper, safe_text(study.subject.name), safe_text(study.subject.label)
    of_path, of_arrows, of_slam = (paper.path, paper.arrows, paper.slam) if paper else (None,) * 3
    figures: dict[str, DrawOne] = {}

    def add(kind: str, number: int | None, title: str, path: FloatArray, **shown: Any) -> None:
        key = f"figure_{number:02d}" if number is not None else f"{study.subject.name}_{kind}"
        text = f"{title[0].upper()}{title[1:]}" if number is None else f"Figure {number}: {title}"
        figures[key] = partial(plot, text, path, **shown)

    add("path", of_path, f"trajectory of the IMU after prediction, {name}", study.predicted)
    add("arrows", of_arrows, f"trajectory of the IMU with orientations, {name}", study.predicted, arrows=True)
    for n, mapped in study.mapped.items():
        title, estimate = f"after landmark update, {label}, N = {n}", mapped.estimate
        number, landmarks = paper.mapped.get(n) if paper else None, estimate.landmarks.position
        add(f"mapped_{n}", number, title, estimate.world_T_imu, landmarks=landmarks)
    title, landmarks = f"visual-inertial SLAM, {label}, N = {study.recorded.features}", study.slam.landmarks.position
    add("slam", of_slam, title, study.slam.world_T_imu, landmarks=landmarks)
    return figures


def plot(title: str, path: FloatArray, *, arrows: bool = False, landmarks: FloatArray | None = None) -> Figure:
    """Figure as in the source paper, of a path (T, 4, 4) and landmarks (m, 3) in the world."""
    figure = Figure(figsize=(SIDE, SIDE))
    axes = figure.subplots()
    xy = path[:, :2, 3]
    box = (robust_window(xy) or Window(-np.ones(2), np.ones(2))).shaped(SQUARE, 0.5, 0.06)
    handles: list[Any] = []
    if landmarks is not None and len(landmarks):
        points = landmarks[:, :2]
        box = box.with_points(points, AROUND * box.side).shaped(SQUARE, 0.0, 0.0)
        shown = box.holds(points)
        axes.scatter(points[shown, 0], points[shown, 1], s=5, color=LANDMARK, linewidths=0, rasterized=True, zorder=1.5)
        handles.append(swatch(LANDMARK, plural(len(points), "landmark")))
        if not shown.all():
            note(axes, f"{plural(int((~shown).sum()), 'landmark')} outside the picture")
    handles += axes.plot(*xy.T, color=PATH, linewidth=1.4, label="path")
    if arrows:
        _arrows(axes, path)
        handles.append(Line2D([], [], color=ARROW, linewidth=1.4, marker=">", markersize=6, label="x axis of the IMU"))
    ends: dict[str, Any] = {"color": ENDS, "linestyle": "none", "markersize": 7, "zorder": 5}
    handles += axes.plot(*known(xy)[:1].T, marker="s", label="start", **ends)
    handles += axes.plot(*known(xy)[-1:].T, marker="o", label="end", **ends)
    width, height = box.high - box.low
    figure.set_size_inches(SIDE, (SIDE - 0.7) * height / width + HEAD)
    frame_top_view(axes, box, "x, m", "y, m")
    title_and_legend(figure, title, handles)
    return figure


def _arrows(axes: Axes, path: FloatArray) -> None:
    chosen = path[:: max(1, len(path) // ARROWS)]
    pointing = chosen[:, :2, 0]
    pointing = pointing / np.maximum(np.linalg.norm(pointing, axis=1, keepdims=True), 1e-12)
    look: dict[str, Any] = {"scale": 24, "width": 0.004, "headwidth": 4, "color": ARROW, "zorder": 3}
    axes.quiver(*chosen[:, :2, 3].T, *pointing.T, angles="xy", **look)


def stages_figure(study: "Study") -> Figure:
    """SLAM beside dead reckoning from above, one panel for the recording as it is and one after each repair."""
    sequence = study.subject.studied
    view = TopView.of_camera(study.predicted[0] @ sequence.imu_T_cam, sequence.up)
    pairs = [tuple(view.plane(poses[:, :3, 3]) for poses in (s.path, s.predicted)) for s in study.staged]
    boxes = [common_window([path], predicted) for path, predicted in pairs]
    width, height = np.max([box.high - box.low for box in boxes], axis=0) * MARGIN
    height = max(height, STAGE_ASPECT * width)
    columns = min(COLUMNS, len(study.staged))
    rows = -(-len(study.staged) // columns)
    panel = (SCREEN.width / columns - 0.6) * height / width
    figure = Figure(figsize=(SCREEN.width, (panel + 0.55) * rows + 0.9))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    handles = []
    for axes, staged, box, (path, predicted) in zip(panels, study.staged, boxes, pairs, strict=False):
        middle = 0.5 * (box.low + box.high)
        handles = axes.plot(*predicted.T, color=DEAD_RECKONING, linewidth=2.2, label="dead reckoning")
        handles += axes.plot(*path.T, color=PATH, linewidth=1.0, label="SLAM, part (c)")
        handles += axes.plot(*predicted[:1].T, "s", color=ENDS, markersize=5, zorder=5, label="start")
        half = 0.5 * np.array([width, height])
        frame_top_view(axes, Window(middle - half, middle + half))
        axes.set_title(f"{staged.stage.name}: {meters(staged.outcome.apart_rmse)}", fontsize=9)
        axes.tick_params(labelsize=7)
    for axes in panels[len(study.staged) :]:
        axes.set_visible(False)
    label = safe_text(study.subject.label)
    title_and_legend(figure, f"{label}, N = {study.recorded.features}: cause by cause, from above, m", handles)
    return figure


def sweep_figure(studies: Several["Study"]) -> Figure:
    """Two maps over features and V for each recording, and below them the filter of figure 9 cause by cause."""
    rows = [len({outcome.settings.pixel_variance for outcome in study.swept}) for study in studies]
    heights = [h for n, s in zip(rows, studies, strict=True) for h in (MAP_ROW * n + ROOM, BAR * len(s.staged) + ROOM)]
    figure = Figure(figsize=(SCREEN.width, sum(heights) + 1.0))
    grid = figure.add_gridspec(2 * len(studies), 2, height_ratios=heights)
    for i, study in enumerate(studies):
        for column, (name, outcomes) in enumerate((("as recorded", study.swept), ("repaired", study.swept_repaired))):
            axes = figure.add_subplot(grid[2 * i, column])
            _map(axes, study, outcomes)
            axes.set_title(f"{safe_text(study.subject.label)}: {name}")
        _bars(figure.add_subplot(grid[2 * i + 1, :]), study)
    broken = "the printed equations break: frames at which (I - KH)Σ is not a covariance"
    frame = Rectangle((0, 0), 1, 1, fill=False, edgecolor=BROKEN, linewidth=2.0, label=broken)
    title_and_legend(figure, "Where the documented filter breaks: distance from dead reckoning (RMS)", [frame])
    return figure


def _map(axes: Axes, study: "Study", outcomes: Several["Outcome"]) -> None:
    features = sorted({o.settings.features or 0 for o in study.swept})
    noises = sorted({o.settings.pixel_variance for o in study.swept})
    axes.set(xlim=(-0.5, len(features) - 0.5), ylim=(-0.5, len(noises) - 0.5), xlabel="features", ylabel="V, px²")
    axes.grid(visible=False)
    axes.set_xticks(range(len(features)), [str(n) for n in features])
    axes.set_yticks(range(len(noises)), [f"{v:g}" for v in noises])
    if not outcomes:
        axes.text(0.5, 0.5, "nothing to repair was found", transform=axes.transAxes, ha="center", va="center")
    broken = []
    for o in outcomes:
        x, y = features.index(o.settings.features or 0), noises.index(o.settings.pixel_variance)
        share = o.apart_rmse / path_length(study.predicted[:, :3, 3])
        level = 1.0 if not np.isfinite(share) else float(np.log(max(share, 1e-9) / LEAST) / np.log(MOST / LEAST))
        color = COLORS(np.clip(level, 0.0, 1.0))
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=color, edgecolor="white", linewidth=0.6))
        if o.breaks:
            broken.append(Rectangle((x - 0.46, y - 0.44), 0.92, 0.88, fill=False, edgecolor=BROKEN, linewidth=2.0))
        light = sum(w * c for w, c in zip((0.3, 0.59, 0.11), color[:3], strict=True)) > 0.5
        axes.text(x, y, _text(o), ha="center", va="center", fontsize=7, color="black" if light else "white")
    for frame in broken:
        axes.add_patch(frame)


def _text(outcome: "Outcome") -> str:
    if outcome.status is Status.FAILED:
        return "stops"
    return meters(outcome.apart_rmse) + (f"\n{plural(outcome.lost, 'frame')}" if outcome.lost else "")


def _bars(axes: Axes, study: "Study") -> None:
    """Bars of the RMS distance from dead reckoning after each repair."""
    values = [staged.outcome.apart_rmse for staged in study.staged]
    rows = range(len(values))
    axes.barh(rows, np.nan_to_num(values), height=0.62, color="#7a8794")
    axes.set_yticks(rows, [staged.stage.name for staged in study.staged])
    axes.invert_yaxis()
    finite = [v for v in values if np.isfinite(v) and v > 0] or [1.0]
    axes.set(xscale="log", xlim=(min(finite) / 3.0, max(finite) * 100.0), xlabel="m from dead reckoning (RMS)")
    axes.grid(axis="y", visible=False)
    for row, staged in zip(rows, study.staged, strict=True):
        o = staged.outcome
        lost = f", lost at {plural(o.lost, 'frame')}" if o.lost else ""
        text = f" {meters(o.apart_rmse)}, {o.reprojection:.3g} px median, {100 * o.behind:.2g} % behind{lost}"
        x = o.apart_rmse if np.isfinite(o.apart_rmse) else min(finite) / 3.0
        axes.text(x, row, text, va="center", fontsize=8, color=BROKEN if o.breaks else "#222222")
    shown = study.recorded.settings
    axes.set_title(f"Cause by cause, N = {shown.features}, V = {shown.pixel_variance:g} I")
