"""Figures of a comparison of trajectories, and of one that a check of accuracy failed."""

from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline import compare
from fgbaseline.compare import Align, MatchedTrajectories
from fgbaseline.compare.columns import Columns
from fgbaseline.compare.statistics.descriptive import without_nan
from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.top_view import TopView
from fgbaseline.geometry import FloatArray

from .evidence import maps_by_depth, three_sigma_of
from .layout import lay_out
from .over_time import TITLE_ROOM, columns, component_panels
from .panels import Line, fit_log_or_linear
from .paths import frame_top_view
from .reprojection import distribution
from .style import GRAY, SCREEN, TRUTH, WHITE, in_style, safe_text, stacked_panels, swatch, title_and_legend
from .style import colors as colors_of
from .style import line as line_of
from .window import common_window

if TYPE_CHECKING:
    from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result

ASPECT = (0.35, 1.1)
"""height over width of the plan, at least and at most"""
CHECK_COLORS = {"ate": "#0072b2", "divergence": "#d55e00"}
CHECK_LABELS = {"ate": "aligned", "divergence": "not aligned"}
ALIGNED = {
    Align.NONE: "not aligned",
    Align.FIRST_POSE: "first poses aligned",
    Align.YAW: "yaw and position aligned",
    Align.SE3: "SE(3)-aligned",
    Align.SIM3: "Sim(3)-aligned",
}


def draw(comparison: "Comparison") -> dict[str, Figure]:
    """Figures by name; those for which there is nothing to show are missing."""
    each: tuple[Callable[[Comparison], Figure | None], ...] = (paths, errors, growth, relative, segments, reprojection)
    with in_style():
        drawn = {one.__name__: one(comparison) for one in each}
        drawn["map"] = _maps(comparison)
        drawn |= {f"three_sigma_{name}": _three_sigma(comparison, r) for name, r in comparison.results.items()}
        figures = {name: figure for name, figure in drawn.items() if figure is not None}
        for figure in figures.values():
            lay_out(figure)
    return figures


def colors(comparison: "Comparison") -> dict[str, str]:
    """Color of each trajectory by name; the reference is black."""
    return colors_of([comparison.reference.name, *comparison.results], comparison.reference.name)


def paths(comparison: "Comparison") -> Figure:
    """All aligned paths over the reference's, from above."""
    view, labels = _view(comparison.up)
    start = comparison.reference.trajectory.position[0]
    reference = view.plane(comparison.reference.trajectory.position - start)
    every = {n: view.plane(r.matched.estimate.position - start) for n, r in comparison.results.items()}
    box = common_window(every.values(), reference).shaped(ASPECT, 1e-3)
    width, height = box.high - box.low
    figure = Figure(figsize=(SCREEN.width, (SCREEN.width - 0.7) * height / width + 1.4))
    axes = figure.subplots()
    color, line = colors(comparison), _lines(comparison)
    handles = axes.plot(*reference.T, **line(comparison.reference.name))
    axes.plot(*reference[-1:].T, "s", color=color[comparison.reference.name], markersize=5)
    for name, path in every.items():
        handles += axes.plot(*path.T, **line(name))
        axes.plot(*path[-1:].T, "s", color=color[name], markersize=5, zorder=4)
    handles += axes.plot(*reference[:1].T, "o", label="start of the reference", markersize=8, **WHITE)
    handles.append(swatch(GRAY, "end"))
    frame_top_view(axes, box, *labels)
    title_and_legend(figure, f"Paths from above, {_alignment(comparison)}", handles)
    return figure


def errors(comparison: "Comparison") -> Figure:
    """Distance, angle and the three components of the difference from the reference, over time."""
    reference, results = comparison.reference, comparison.results
    t = {n: np.asarray(r.matched.reference.t - reference.trajectory.t[0]) for n, r in results.items()}
    figure, axes, handles = component_panels(_departures(comparison), t, _lines(comparison))
    axes[-1].set_xlabel("time, s" if reference.trajectory.stamped else "frame")
    rivals = [r for r in comparison.ranked if not r.entry.by_product] or comparison.ranked
    ranking = comparison.ranking
    nearest = [f"{safe_text(r.name)} {ranking.rmse(r.name):.3g} m" for r in rivals if r.name in ranking.at]
    each = ", ".join(nearest) if sum(map(len, nearest)) < TITLE_ROOM else f"nearest {nearest[0]}"
    title_and_legend(figure, f"Difference from {safe_text(reference.name)} (RMSE: {each})", handles)
    return figure


def growth(comparison: "Comparison") -> Figure:
    """Distance and heading over the length of the path."""
    tables, line = _departures(comparison), _lines(comparison)
    has_heading = any(np.isfinite(table["heading_deg"]).any() for table in tables.values())
    figure, axes = stacked_panels(4.6 if has_heading else 2.7, rows=1 + has_heading)
    handles: list[Any] = []
    for panel, column in zip(axes, ("position", "heading_deg"), strict=False):
        for name, table in tables.items():
            handles += panel.plot(table["travelled"], table[column], **line(name))
    axes[0].set_ylabel("distance, m")
    fit_log_or_linear(axes[0], columns(tables, "position"))
    if has_heading:
        axes[1].set_ylabel("heading, °")
        axes[1].axhline(0.0, color="#999999", linewidth=0.8, zorder=1.8)
    axes[-1].set_xlabel("length of the reference's path so far, m")
    title_and_legend(figure, f"How the difference grows along the path, {_alignment(comparison)}", handles)
    return figure


def relative(comparison: "Comparison") -> Figure | None:
    """Errors of the motion over each delta, as boxes; None where the paths are too short for all."""
    deltas = [d for d in comparison.deltas if any(d in r.relative for r in comparison.results.values())]
    if not deltas:
        return None
    n = len(comparison.results)
    figure = Figure(figsize=(SCREEN.width, 0.9 + len(deltas) * (0.75 + 0.27 * n)))
    panels = figure.subplots(len(deltas), 2, squeeze=False, sharey=True)
    for row, delta in zip(panels, deltas, strict=True):
        motions = {name: r.relative[delta] for name, r in comparison.results.items() if delta in r.relative}
        for panel, column, unit in zip(row, ("translation", "rotation_deg"), ("m", "°"), strict=True):
            _boxes(comparison, panel, motions, column)
            panel.set_xlabel(f"over {delta}: {'translation' if unit == 'm' else 'rotation'}, {unit}")
            panel.set_xlim(left=0.0)
    pairs = "all pairs" if comparison.settings.all_pairs else "consecutive pairs"
    title_and_legend(figure, f"Errors of the motion between {pairs} of poses")
    return figure


def _boxes(comparison: "Comparison", panel: Axes, motions: Mapping[str, Columns], column: str) -> None:
    color, names = colors(comparison), list(comparison.results)
    for name, table in motions.items():
        panel.boxplot(
            [without_nan(table[column])],
            positions=[names.index(name)],
            orientation="horizontal",
            widths=0.55,
            whis=(5, 95),
            showfliers=False,
            patch_artist=True,
            boxprops={"facecolor": color[name], "alpha": 0.45, "edgecolor": color[name]},
            medianprops={"color": "#222222", "linewidth": 1.6},
            whiskerprops={"color": color[name]},
            capprops={"color": color[name]},
        )
    panel.set_yticks(range(len(names)), [safe_text(name) for name in names])
    panel.set_ylim(len(names) - 0.5, -0.5)
    panel.grid(axis="y", visible=False)


def segments(comparison: "Comparison") -> Figure | None:
    """KITTI's segment errors by the length of the segments; None where none has two lengths."""
    known = {n: r.segments for n, r in comparison.results.items() if r.segments is not None}
    if not any(len(found.means_by_length["n"]) > 1 for found in known.values()):
        return None  # the table says as much
    figure = Figure(figsize=(SCREEN.width, 3.4))
    panels = figure.subplots(1, 2)
    line = _lines(comparison)
    handles: list[Any] = []
    columns_shown = {"translation_percent": "translation, %", "rotation_deg_per_m": "rotation, °/m"}
    for panel, (column, title) in zip(panels, columns_shown.items(), strict=True):
        for name, found in known.items():
            look = {**line(name), "marker": "o", "markersize": 4}
            means = found.means_by_length
            handles += panel.plot(means["length"], means[column], **look)
        panel.set_ylabel(title)
        panel.set_xlabel("length of the segments, m")
        panel.set_ylim(bottom=0.0)
    official = all(found.official for found in known.values())
    which = "KITTI's lengths" if official else "lengths fitted to the path, not KITTI's"
    title_and_legend(figure, f"Segment errors ({which})", handles)
    return figure


def reprojection(comparison: "Comparison") -> Figure | None:
    """Share of the observations that each path explains to within so many pixels; None without observations."""
    every = {comparison.reference.name: comparison.reference_pixels}
    every |= {name: result.pixels for name, result in comparison.results.items()}
    known = {name: p for name, p in every.items() if p is not None and p.along is not None and len(p.along)}
    if not known:
        return None
    along = {name: p.along["error"] for name, p in known.items() if p.along is not None}
    own = {name: p.own["error"] for name, p in known.items() if p.own is not None and len(p.own)}
    labels = ["triangulated along the path", *(["its own landmarks"] if own else [])]
    return distribution(along, own, _lines(comparison), labels)


def _maps(comparison: "Comparison") -> Figure | None:
    maps = {name: r.map for name, r in comparison.results.items() if r.map is not None}
    tables = {name: compare.map_by_depth(m) for name, m in maps.items()}
    return maps_by_depth(tables, _lines(comparison), comparison.reference.name)


def _three_sigma(comparison: "Comparison", result: "Result") -> Figure | None:
    reported = result.reported_covariance
    if reported is None or not np.isfinite(reported.nees).any():
        return None
    t = np.asarray(result.matched.reference.t - comparison.reference.trajectory.t[0])
    return three_sigma_of(result.name, t, reported.error, reported.covariance, _lines(comparison)(result.name))


def _departures(comparison: "Comparison") -> dict[str, Columns]:
    return {name: result.departure for name, result in comparison.results.items()}


def _lines(comparison: "Comparison") -> Line:
    color, reference = colors(comparison), comparison.reference.name
    return lambda name: line_of(name, color[name], reference)


def _alignment(comparison: "Comparison") -> str:
    return ALIGNED[next(iter(comparison.results.values())).matched.alignment.kind]


def _view(up: FloatArray) -> tuple[TopView, tuple[str, str]]:
    """Plan, and the names of its axes: the world's own where up is one of them."""
    ahead = next(axis - (axis @ up) * up for axis in np.eye(3) if abs(axis @ up) < 0.7)
    ahead = ahead / np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    return TopView(ahead, left, up), (f"{_named(ahead)}, m", f"{_named(left)}, m")


def _named(direction: FloatArray) -> str:
    """World's axis that a direction is, or is nearest to once made level."""
    k = int(np.argmax(np.abs(direction)))
    sign = "" if direction[k] > 0 else "\N{MINUS SIGN}"
    return f"{sign}{'xyz'[k]}" + ("" if abs(direction[k]) > 1 - 1e-9 else ", level") + " from the start"


def draw_failed_check(
    aligned: MatchedTrajectories, errors: Mapping[str, tuple[pd.DataFrame, float | None]], path: Path
) -> None:
    """Draws into the PNG `path`, whose folder is made: both paths, and each table's `translation` with its bound.

    `errors` has the tables of `absolute_errors` by what was aligned, and the largest distance allowed, m.
    """
    with in_style():
        figure = Figure(figsize=(SCREEN.width, 7.0))
        above, below = figure.subplots(2, 1, height_ratios=(2, 1))
        _aligned_paths(above, aligned)
        for name, (table, largest) in errors.items():
            below.plot(
                table["t"] - table["t"].iloc[0],
                table["translation"],
                color=CHECK_COLORS[name],
                label=CHECK_LABELS[name],
            )
            if largest is not None:
                below.axhline(largest, color=CHECK_COLORS[name], linestyle=(0, (4, 2)), linewidth=1.0)
        below.set(
            xlabel="time since the first pose, s" if aligned.reference.stamped else "frame",
            ylabel="distance, m",
            ylim=(0, None),
        )
        below.legend()
        stream = BytesIO()
        figure.savefig(stream, format="png", dpi=120)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as file:
        file.write(stream.getvalue())


def _aligned_paths(axes: Axes, aligned: MatchedTrajectories) -> None:
    plane = widest_plane(aligned.reference.position)
    here = aligned.reference.position @ plane
    axes.plot(*here.T, color=TRUTH, linestyle=(0, (4, 2)), linewidth=1.8, label=safe_text(aligned.reference.name))
    axes.plot(*(aligned.estimate.position @ plane).T, color=CHECK_COLORS["ate"], label=safe_text(aligned.estimate.name))
    axes.plot(*here[0], color=TRUTH, marker="o", linestyle="none", label="start")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(
        xlabel="m", ylabel="m", title=f"in the plane in which {safe_text(aligned.reference.name)} is widest, aligned"
    )
    axes.legend()


def widest_plane(positions: FloatArray) -> FloatArray:
    """(3, 2) orthonormal directions in which positions (n, 3) spread most."""
    _, _, Vt = np.linalg.svd(positions - positions.mean(axis=0), full_matrices=True)
    return np.asarray(Vt[:2].T)
