"""The figures of a comparison, in the look of a run's."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fgbaseline.compare import Align
from fgbaseline.geometry import FloatArray

from ..figures.beyond import maps_by_depth
from ..figures.consistency import three_sigma_of
from ..figures.frames import fit_log_or_linear
from ..figures.layout import lay_out
from ..figures.lettering import plain
from ..figures.style import WIDTH, head, in_style, sheet, swatch
from ..figures.view import TopView
from ..figures.window import Window, common_window
from .comparison import Comparison, Result
from .lines import colours, line
from .motion_figures import relative, segments
from .pixel_figure import reprojection

TITLES = {
    "position": "distance, m",
    "rotation_deg": "rotation, °",
    "along": "along, m",
    "across": "to the left, m",
    "up": "up, m",
}
GROWTH = {"position": "distance, m", "heading_deg": "heading, °"}
LETTERS = 58
"""that a headline has room for"""
SLIMMEST = (0.35, 1.1)
"""height over width of the plan, at least and at most"""
ALIGNED = {
    Align.NONE: "not aligned",
    Align.FIRST_POSE: "first poses aligned",
    Align.YAW: "yaw and position aligned",
    Align.SE3: "SE(3)-aligned",
    Align.SIM3: "Sim(3)-aligned",
}


def draw(comparison: Comparison) -> dict[str, Figure]:
    """The figures by name; those for which there is nothing to show are missing."""
    with in_style():
        figures = {"paths": paths(comparison), "errors": errors(comparison), "growth": growth(comparison)}
        drawn: Mapping[str, Figure | None] = {
            "relative": relative(comparison),
            "segments": segments(comparison),
            "reprojection": reprojection(comparison),
            "map": _maps(comparison),
            **{f"three_sigma_{name}": _three_sigma(comparison, r) for name, r in comparison.results.items()},
        }
        figures |= {name: figure for name, figure in drawn.items() if figure is not None}
        for figure in figures.values():
            lay_out(figure)
    return figures


def paths(comparison: Comparison) -> Figure:
    """All aligned paths over the reference's, from above."""
    view, (first, second) = _view(comparison.up)
    start = comparison.reference.trajectory.position[0]
    reference = view.plane(comparison.reference.trajectory.position - start)
    every = {n: view.plane(r.matched.estimate.position - start) for n, r in comparison.results.items()}
    box = _padded(common_window(every.values(), reference))
    width, height = box.high - box.low
    figure = Figure(figsize=(WIDTH, (WIDTH - 0.7) * height / width + 1.4))
    axes = figure.subplots()
    colour = colours(comparison)
    handles = axes.plot(*reference.T, **line(comparison, comparison.reference.name))
    axes.plot(*reference[-1:].T, "s", color=colour[comparison.reference.name], markersize=5)
    for name, path in every.items():
        handles += axes.plot(*path.T, **line(comparison, name))
        axes.plot(*path[-1:].T, "s", color=colour[name], markersize=5, zorder=4)
    white: dict[str, Any] = {"color": "white", "markeredgecolor": "black", "markersize": 8, "zorder": 5}
    handles += axes.plot(*reference[:1].T, "o", label="start of the reference", **white)
    handles.append(swatch("#555555", "end"))
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(box.low[0], box.high[0])
    axes.set_ylim(box.low[1], box.high[1])
    axes.set_xlabel(f"{first}, m")
    axes.set_ylabel(f"{second}, m")
    head(figure, f"Paths from above, {_alignment(comparison)}", handles)
    return figure


def errors(comparison: Comparison) -> Figure:
    """Distance, angle and the three components of the way from the reference, over time."""
    every = _known(comparison, TITLES)
    ratios = [1.7, *[1.0] * (len(every) - 1)]
    figure, axes = sheet(8.6 * sum(ratios) / 5.7, rows=len(every), height_ratios=ratios)
    handles: list[Line2D] = []
    for panel, (column, series) in zip(axes, every.items(), strict=True):
        for name, values in series.items():
            handles += panel.plot(_seconds(comparison, comparison.results[name]), values, **line(comparison, name))
        panel.set_ylabel(TITLES[column])
        _fit(panel, column, series)
    axes[-1].set_xlabel("time, s" if comparison.reference.trajectory.stamped else "frame")
    rivals = [r for r in comparison.ranked if not r.entry.by_product] or comparison.ranked
    ranking = comparison.ranking
    nearest = [f"{plain(r.name)} {ranking.rmse(r.name):.3g} m" for r in rivals if r.name in ranking.at]
    said = ", ".join(nearest) if sum(map(len, nearest)) < LETTERS else f"nearest {nearest[0]}"
    head(figure, f"Difference from {plain(comparison.reference.name)} (RMSE: {said})", handles)
    return figure


def growth(comparison: Comparison) -> Figure:
    """Distance and heading over the length of the path."""
    every = _known(comparison, GROWTH)
    figure, axes = sheet(0.8 + 1.9 * len(every), rows=len(every))
    handles: list[Line2D] = []
    for panel, (column, series) in zip(axes, every.items(), strict=True):
        for name, values in series.items():
            travelled = comparison.results[name].departure["travelled"]
            handles += panel.plot(travelled, values, **line(comparison, name))
        panel.set_ylabel(GROWTH[column])
        _fit(panel, column, series)
    axes[-1].set_xlabel("length of the reference's path so far, m")
    head(figure, f"How the difference grows along the path, {_alignment(comparison)}", handles)
    return figure


def _known(comparison: Comparison, columns: Mapping[str, str]) -> dict[str, dict[str, FloatArray]]:
    """The columns of the difference, by estimate, that some estimate has: positions without orientations lack two."""
    every = {
        column: {n: r.departure[column].to_numpy(dtype=np.float64) for n, r in comparison.results.items()}
        for column in columns
    }
    return {c: series for c, series in every.items() if any(np.isfinite(values).any() for values in series.values())}


def _maps(comparison: Comparison) -> Figure | None:
    known = {name: r.map for name, r in comparison.results.items() if r.map is not None}
    return maps_by_depth(known, {name: line(comparison, name) for name in known}, comparison.reference.name)


def _three_sigma(comparison: Comparison, result: Result) -> Figure | None:
    claimed = result.claimed
    if claimed is None or not np.isfinite(claimed.nees).any():
        return None
    t, style = _seconds(comparison, result), line(comparison, result.name)
    return three_sigma_of(result.name, t, claimed.error, claimed.covariance, style)


def _seconds(comparison: Comparison, result: Result) -> FloatArray:
    return np.asarray(result.matched.reference.t - comparison.reference.trajectory.t[0])


def _fit(panel: Axes, column: str, series: Mapping[str, FloatArray]) -> None:
    if column in ("position", "rotation_deg"):
        fit_log_or_linear(panel, series)
    else:
        panel.axhline(0.0, color="#999999", linewidth=0.8, zorder=1.8)


def _alignment(comparison: Comparison) -> str:
    kind = next(iter(comparison.results.values())).matched.alignment.kind
    return ALIGNED[kind]


def _view(up: FloatArray) -> tuple[TopView, tuple[str, str]]:
    """The plan, and what its axes are called: the world's own where up is one of them."""
    ahead = next(axis - (axis @ up) * up for axis in np.eye(3) if abs(axis @ up) < 0.7)
    ahead = ahead / np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    return TopView(ahead, left, up), (_named(ahead), _named(left))


def _named(direction: FloatArray) -> str:
    """The world's axis that a direction is, or is nearest to once made level."""
    k = int(np.argmax(np.abs(direction)))
    sign = "" if direction[k] > 0 else "\N{MINUS SIGN}"
    return f"{sign}{'xyz'[k]}" + ("" if abs(direction[k]) > 1 - 1e-9 else ", level") + " from the start"


def _padded(box: Window) -> Window:
    box = box.grown(max(0.04 * box.side, 1e-3))
    width, height = box.high - box.low
    missing = np.array([height / SLIMMEST[1] - width, width * SLIMMEST[0] - height]).clip(min=0.0)
    return Window(box.low - 0.5 * missing, box.high + 0.5 * missing)
