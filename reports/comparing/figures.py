"""The figures of a comparison, in the look of a run's."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fgbaseline.compare import Align
from fgbaseline.geometry import FloatArray

from ..figures.drawing import lay_out
from ..figures.frames import fit_log_or_linear
from ..figures.lettering import plain
from ..figures.palette import colours_of
from ..figures.reprojections import GRID, share_within
from ..figures.style import WIDTH, head, in_style, sheet, swatch
from ..figures.view import TopView
from ..figures.window import Window, common_window
from .comparison import Comparison, Result
from .pixels import Pixels
from .wording import ranked, rmse

TITLES = {
    "position": "distance, m",
    "rotation_deg": "rotation, °",
    "along": "along, m",
    "across": "to the left, m",
    "up": "up, m",
}
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
THIN: Mapping[str, Any] = {"linewidth": 1.0, "linestyle": (0, (2, 1.5))}


def draw(comparison: Comparison) -> dict[str, Figure]:
    """The figures by name; those for which there is nothing to show are missing."""
    with in_style():
        figures = {"paths": paths(comparison), "errors": errors(comparison), "growth": growth(comparison)}
        drawn: Mapping[str, Figure | None] = {
            "relative": relative(comparison),
            "segments": segments(comparison),
            "reprojection": reprojection(comparison),
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
    colours = _colours(comparison)
    handles = axes.plot(*reference.T, **_line(comparison, comparison.reference.name))
    axes.plot(*reference[-1:].T, "s", color=colours[comparison.reference.name], markersize=5)
    for name, path in every.items():
        handles += axes.plot(*path.T, **_line(comparison, name))
        axes.plot(*path[-1:].T, "s", color=colours[name], markersize=5, zorder=4)
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
    figure, axes = sheet(8.6, rows=len(TITLES), height_ratios=[1.7, 1.0, 1.0, 1.0, 1.0])
    handles: list[Line2D] = []
    for panel, (column, title) in zip(axes, TITLES.items(), strict=True):
        series = {n: r.departure[column].to_numpy(dtype=np.float64) for n, r in comparison.results.items()}
        for name, values in series.items():
            handles += panel.plot(_seconds(comparison, comparison.results[name]), values, **_line(comparison, name))
        panel.set_ylabel(title)
        _fit(panel, column, series)
    figure.align_ylabels(axes)
    axes[-1].set_xlabel("time, s" if comparison.reference.trajectory.stamped else "frame")
    rivals = [r for r in ranked(comparison) if not r.entry.by_product] or ranked(comparison)
    nearest = [f"{plain(r.name)} {rmse(r):.3g} m" for r in rivals]
    said = ", ".join(nearest) if sum(map(len, nearest)) < LETTERS else f"nearest {nearest[0]}"
    head(figure, f"Difference from {plain(comparison.reference.name)} (RMSE: {said})", handles)
    return figure


def growth(comparison: Comparison) -> Figure:
    """Distance and heading over the length of the path."""
    figure, axes = sheet(4.6, rows=2)
    handles: list[Line2D] = []
    for panel, (column, title) in zip(
        axes, {"position": "distance, m", "heading_deg": "heading, °"}.items(), strict=True
    ):
        series = {n: r.departure[column].to_numpy(dtype=np.float64) for n, r in comparison.results.items()}
        for name, values in series.items():
            travelled = comparison.results[name].departure["travelled"]
            handles += panel.plot(travelled, values, **_line(comparison, name))
        panel.set_ylabel(title)
        _fit(panel, column, series)
    figure.align_ylabels(axes)
    axes[-1].set_xlabel("length of the reference's path so far, m")
    head(figure, f"How the difference grows along the path, {_alignment(comparison)}", handles)
    return figure


def relative(comparison: Comparison) -> Figure | None:
    """Errors of the motion over each delta, as boxes."""
    deltas = [d for d in comparison.deltas if any(d in r.relative for r in comparison.results.values())]
    if not deltas:
        return None
    names = list(comparison.results)
    figure = Figure(figsize=(WIDTH, 0.9 + len(deltas) * (0.75 + 0.27 * len(names))))
    panels = figure.subplots(len(deltas), 2, squeeze=False, sharey=True)
    for row, delta in zip(panels, deltas, strict=True):
        for panel, column, unit in zip(row, ("translation", "rotation_deg"), ("m", "°"), strict=True):
            _boxes(comparison, panel, delta, column)
            panel.set_xlabel(f"over {delta}: {'translation' if unit == 'm' else 'rotation'}, {unit}")
            panel.set_xlim(left=0.0)
    pairs = "all pairs" if comparison.settings.all_pairs else "consecutive pairs"
    head(figure, f"Errors of the motion between {pairs} of poses")
    return figure


def _boxes(comparison: Comparison, panel: Axes, delta: str, column: str) -> None:
    colours = _colours(comparison)
    for i, (name, result) in enumerate(comparison.results.items()):
        if delta in result.relative:
            panel.boxplot(
                [result.relative[delta][column].dropna().to_numpy()],
                positions=[i],
                orientation="horizontal",
                widths=0.55,
                whis=(5, 95),
                showfliers=False,
                patch_artist=True,
                boxprops={"facecolor": colours[name], "alpha": 0.45, "edgecolor": colours[name]},
                medianprops={"color": "#222222", "linewidth": 1.6},
                whiskerprops={"color": colours[name]},
                capprops={"color": colours[name]},
            )
    panel.set_yticks(range(len(comparison.results)), [plain(name) for name in comparison.results])
    panel.set_ylim(len(comparison.results) - 0.5, -0.5)
    panel.grid(axis="y", visible=False)


def segments(comparison: Comparison) -> Figure | None:
    """KITTI's segment errors by the length of the segments."""
    known = {n: r.segments for n, r in comparison.results.items() if r.segments is not None}
    if not known:
        return None
    figure = Figure(figsize=(WIDTH, 3.4))
    left, right = figure.subplots(1, 2)
    handles: list[Line2D] = []
    for name, found in known.items():
        table = found.by_length
        style = {**_line(comparison, name), "marker": "o", "markersize": 4}
        handles += left.plot(table.index, table["translation_percent"], **style)
        right.plot(table.index, table["rotation_deg_per_m"], **style)
    for panel, title in ((left, "translation, %"), (right, "rotation, °/m")):
        panel.set_ylabel(title)
        panel.set_xlabel("length of the segments, m")
        panel.set_ylim(bottom=0.0)
    official = all(found.official for found in known.values())
    which = "KITTI's lengths" if official else "lengths fitted to the path, not KITTI's"
    head(figure, f"Segment errors ({which})", handles)
    return figure


def reprojection(comparison: Comparison) -> Figure | None:
    """The share of the observations that each path explains to within so many pixels."""
    every: dict[str, Pixels | None] = {comparison.reference.name: comparison.reference_pixels}
    every |= {name: result.pixels for name, result in comparison.results.items()}
    known = {name: p for name, p in every.items() if p is not None and p.along is not None and len(p.along)}
    if not known:
        return None
    figure, (axes,) = sheet(4.2)
    handles: list[Line2D] = []
    for name, pixels in known.items():
        assert pixels.along is not None
        style = _line(comparison, name)
        handles += axes.plot(GRID, 100.0 * share_within(pixels.along["error"], GRID), **style)
        if pixels.own is not None and len(pixels.own):
            axes.plot(GRID, 100.0 * share_within(pixels.own["error"], GRID), **{**style, **THIN, "label": None})
    axes.set_xscale("log")
    last = max(float(np.nanpercentile(p.along["error"], 99)) for p in known.values() if p.along is not None)
    axes.set_xlim(GRID[0], float(np.clip(last, 30.0, GRID[-1])))
    axes.set_ylim(0.0, 101.0)
    axes.set_xlabel("reprojection error, px (norm of the four differences)")
    axes.set_ylabel("share of observations, %")
    handles += axes.plot([], [], color="#555555", label="triangulated along the path")
    if any(p.own is not None for p in known.values()):
        handles += axes.plot([], [], color="#555555", label="its own landmarks", **THIN)
    head(figure, "Share of the observations explained to within so many pixels", handles)
    return figure


def _colours(comparison: Comparison) -> dict[str, str]:
    return colours_of([comparison.reference.name, *comparison.results], comparison.reference.name)


def _line(comparison: Comparison, name: str) -> dict[str, Any]:
    is_reference = name == comparison.reference.name
    return {
        "color": _colours(comparison)[name],
        "linewidth": 2.6 if is_reference else 1.3,
        "zorder": 2.0 if is_reference else 2.5,
        "label": plain(name) + (" (reference)" if is_reference else ""),
    }


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
