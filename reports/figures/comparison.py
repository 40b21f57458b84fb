"""Figures of a comparison of trajectories, and of one that a check of accuracy failed."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cbook import boxplot_stats
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fgbaseline.compare import MatchedTrajectories
from fgbaseline.compare.statistics.descriptive import without_nan
from fgbaseline.data.formats.files.atomic_write import atomic_write
from fgbaseline.geometry import FloatArray

from .comparison_data import ComparisonData, of_comparison
from .drawing import Captioned, DrawOne, drawn_for_paper
from .layout import title_and_legend
from .over_time import TITLE_ROOM, three_sigma
from .panels import columns, common_window, component_panels, few_ticks, fit_log_or_linear, frame_top_view
from .paths import overlaid
from .residuals import distribution, map_difference
from .style import SCREEN, TRUTH, Style, in_style, safe_text, stacked_panels

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result

ASPECT = (0.35, 1.1)
"""height over width of the plan, at least and at most"""
BOX = 0.55
"""height of a box, of 1 from one estimate to the next"""
CHECK_ALIGNED = "#0072b2"
CHECK_LINES = {"ate": (CHECK_ALIGNED, "aligned"), "divergence": ("#d55e00", "not aligned")}


def figure_functions(comparison: "Comparison") -> dict[str, DrawOne]:
    """Functions that draw each figure, by name, within `in_style()` and without layout; each may answer None."""
    data = of_comparison(comparison)
    each: dict[str, DrawOne] = {name: partial(draw_one, data) for name, (draw_one, _) in EACH.items()}
    each["reprojection"] = partial(_reprojection, comparison, data)
    return each | {f"three_sigma_{n}": partial(_three_sigma, data, r) for n, r in comparison.results.items()}


def draw_for_paper(data: ComparisonData) -> dict[str, tuple[Figure, str]]:
    """Figures of a comparison for a paper in two columns: name -> figure and caption."""
    words = {"reference": data.reference, "alignment": data.alignment, "pairs": data.pairs, "lengths": data.lengths}
    return drawn_for_paper(data, EACH, words)


def paths(data: ComparisonData, style: Style = SCREEN) -> Figure:
    """All aligned paths over the reference's, from above."""
    flat = {name: data.paths[name][:, :2] for name in (data.reference, *data.names)}
    box = common_window([flat[name] for name in data.names], flat[data.reference]).shaped(ASPECT, 1e-3)
    width, height = box.high - box.low
    figure = Figure(figsize=(style.width, (style.width - 0.6) * height / width + (1.4 if style.titled else 0.75)))
    axes = figure.subplots()
    handles = overlaid(axes, flat, data.line(style), style, start="start of the reference")
    frame_top_view(axes, box, *(f"{name} from the start, m" for name in data.axes[:2]))
    title_and_legend(figure, f"Trajectories from above, {data.alignment}", handles, style)
    return figure


def errors(data: ComparisonData, style: Style = SCREEN) -> Figure:
    """Distance and angle, on the screen also the components, of the difference from the reference over time."""
    figure, axes, handles = component_panels(data.series, data.t, data.line(style), style)
    axes[-1].set_xlabel("time, s" if data.stamped else "frame")
    nearest = [f"{safe_text(name)} {rmse:.3g} m" for name, rmse in data.rmse.items()]
    each = ", ".join(nearest) if sum(map(len, nearest)) < TITLE_ROOM else f"nearest {nearest[0]}"
    title = f"Errors against {safe_text(data.reference)}, {data.alignment}" + (f" (RMSE: {each})" if nearest else "")
    title_and_legend(figure, title, handles, style)
    return figure


def growth(data: ComparisonData, style: Style = SCREEN) -> Figure:
    """Distance and heading over the length of the path."""
    line = data.line(style)
    has_heading = any(np.isfinite(table["heading_deg"]).any() for table in data.series.values())
    height = (0.8 + 1.9 * (1 + has_heading)) if style.titled else style.room + 0.95 * (1 + has_heading)
    figure, axes = stacked_panels(height, 1 + has_heading, style)
    handles: list[Any] = []
    for panel, column in zip(axes, ("position", "heading_deg"), strict=False):
        for name, table in data.series.items():
            handles += panel.plot(table["traveled"], table[column], **line(name))
    axes[0].set_ylabel("distance, m")
    fit_log_or_linear(axes[0], columns(data.series, "position"))
    few_ticks(axes[0], style)
    if has_heading:
        axes[1].set_ylabel("heading, °")
        axes[1].axhline(0.0, color="#999999", linewidth=0.8, zorder=1.8)
    axes[-1].set_xlabel("path length of the reference so far, m")
    title_and_legend(figure, f"Position and heading error over the path length, {data.alignment}", handles, style)
    return figure


def relative(data: ComparisonData, style: Style = SCREEN) -> Figure | None:
    """Errors of the motion over each delta, as boxes; None where the paths are too short for all."""
    if not data.relative:
        return None
    names = [name for name in data.names if any(name in motions for motions in data.relative.values())]
    rows, inch = len(data.relative), (1.0 if style.titled else 0.6)
    figure = Figure(figsize=(style.width, 1.1 * inch + rows * inch * (0.75 + 0.27 * len(names))))
    panels = figure.subplots(rows, 2, squeeze=False, sharey=True)
    handles: list[Any] = []
    for row, (delta, motions) in zip(panels, data.relative.items(), strict=True):
        for panel, column, unit in zip(row, ("translation", "rotation_deg"), ("m", "°"), strict=True):
            for name, table in motions.items():
                handles += _box(panel, names.index(name), without_nan(table[column]), data.colors[name])
            panel.set_yticks(range(len(names)), [safe_text(name) for name in names])
            panel.set_ylim(len(names) - 0.5, -0.5)
            panel.grid(axis="y", visible=False)
            panel.set(xlabel=f"over {delta}: {column.removesuffix('_deg')}, {unit}", xlim=(0.0, None))
    over = " and ".join(data.relative)
    legend = handles[:2] if style.titled else []
    title_and_legend(figure, f"Relative errors (RPE) over {over}, {data.pairs}", legend, style)
    return figure


def _box(panel: Axes, y: float, values: FloatArray, color: str) -> list[Any]:
    """Draws a horizontal box at a height, as `Axes.boxplot` has it, which imports pyplot and makes more artists.

    Gives the legend's handles of median and RMSE.
    """
    (at,) = boxplot_stats(values, whis=(5, 95))
    low, q1, median, q3, high, apart = (*(at[key] for key in ("whislo", "q1", "med", "q3", "whishi")), np.nan)
    box = Rectangle((q1, y - BOX / 2), q3 - q1, BOX, zorder=2.0, facecolor=color, alpha=0.45, edgecolor=color)
    panel.add_artist(box)
    whiskers = [low, low, apart, low, q1, apart, q3, high, apart, high, high]
    caps = y + BOX / 4 * np.array([-1, 1, apart, 0, 0, apart, 0, 0, apart, -1, 1])
    panel.plot(whiskers, caps, color=color, linewidth=1.0)
    dark: dict[str, Any] = {"color": "#222222", "zorder": 2.1}
    middle = panel.plot([median, median], [y - BOX / 2, y + BOX / 2], linewidth=1.6, label="median", **dark)
    rmse = float(np.sqrt(np.mean(values**2)))  # beyond the whisker where few pairs make it
    return [*middle, *panel.plot([rmse], [y], marker="D", markersize=3.5, linestyle="none", label="RMSE", **dark)]


def segments(data: ComparisonData, style: Style = SCREEN) -> Figure | None:
    """KITTI's segment errors by the length of the segments; None where none has two lengths."""
    if not any(len(means["n"]) > 1 for means in data.segments.values()):
        return None  # the table has the same value
    figure = Figure(figsize=(style.width, 3.4 if style.titled else 1.8))
    panels = figure.subplots(1, 2)
    line = data.line(style, max(len(means["n"]) for means in data.segments.values()))
    handles: list[Any] = []
    columns_shown = {"translation_percent": "translation, %", "rotation_deg_per_m": "rotation, °/m"}
    for panel, (column, title) in zip(panels, columns_shown.items(), strict=True):
        for name, means in data.segments.items():
            look = {"marker": "o", "markersize": 4} if style.titled else {}
            handles += panel.plot(means["length"], means[column], **{**line(name), **look})
        panel.set(xlabel="length of the segments, m", ylabel=title, ylim=(0.0, None))
    title_and_legend(figure, f"Segment errors ({data.lengths})", handles, style)
    return figure


EACH: Captioned = {
    "paths": (paths, "Trajectories from above, {alignment} to {reference}."),
    "errors": (errors, "Position and rotation error against {reference} over time, {alignment}."),
    "growth": (growth, "Position and heading error against {reference} over its path length, {alignment}."),
    "relative": (relative, "Relative errors (RPE), {pairs}; boxes hold the middle half, whiskers 90 %; diamond: RMSE."),
    "segments": (segments, "Segment errors ({lengths})."),
    "map": (map_difference, "Median distance of landmarks from those of {reference}, in the camera frame, by depth."),
}


def _reprojection(comparison: "Comparison", data: ComparisonData) -> Figure | None:
    """Share of the observations that each path explains to within so many pixels; None without observations."""
    pixels = comparison.pixels
    along = {name: p.along["error"] for name, p in pixels.items() if p.along is not None and len(p.along)}
    own = {name: p.own["error"] for name, p in pixels.items() if name in along and p.own is not None and len(p.own)}
    if not along:
        return None
    labels = ["triangulated along the trajectory", *(["its own landmarks"] if own else [])]
    return distribution(along, own, data.line(), labels)


def _three_sigma(data: ComparisonData, result: "Result") -> Figure | None:
    reported, name = result.reported_covariance, result.name
    if reported is None or not np.isfinite(reported.nees).any():
        return None
    return three_sigma(name, data.t[name], reported.error, reported.covariance, data.line()(name))


def draw_failed_check(
    aligned: MatchedTrajectories, errors: "Mapping[str, tuple[pd.DataFrame, float | None]]", path: Path
) -> None:
    """Draws into the PNG `path`, whose folder is made: both paths, and each table's `translation` with its bound.

    `errors` has the tables of `absolute_errors` by what was aligned, and the largest distance allowed, m.
    """
    with in_style():
        figure = Figure(figsize=(SCREEN.width, 7.0))
        above, below = figure.subplots(2, 1, height_ratios=(2, 1))
        _aligned_paths(above, aligned)
        for name, (table, largest) in errors.items():
            color, label = CHECK_LINES[name]
            below.plot(table["t"] - table["t"].iloc[0], table["translation"], color=color, label=label)
            if largest is not None:
                below.axhline(largest, color=color, linestyle=(0, (4, 2)), linewidth=1.0)
        moment = "time since the first pose, s" if aligned.reference.stamped else "frame"
        below.set(xlabel=moment, ylabel="distance, m", ylim=(0, None))
        below.legend()
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as file:
            figure.savefig(file, format="png", dpi=120)


def _aligned_paths(axes: Axes, aligned: MatchedTrajectories) -> None:
    reference = aligned.reference.position
    _, _, Vt = np.linalg.svd(reference - reference.mean(axis=0), full_matrices=True)
    plane = Vt[:2].T  # in which the reference spreads most
    here = reference @ plane
    axes.plot(*here.T, color=TRUTH, linestyle=(0, (4, 2)), linewidth=1.8, label=safe_text(aligned.reference.name))
    axes.plot(*(aligned.estimate.position @ plane).T, color=CHECK_ALIGNED, label=safe_text(aligned.estimate.name))
    axes.plot(*here[0], color=TRUTH, marker="o", linestyle="none", label="start")
    title = f"in the plane in which {safe_text(aligned.reference.name)} is widest, aligned"
    axes.set(aspect="equal", adjustable="datalim", xlabel="m", ylabel="m", title=title)
    axes.legend()
