"""Residuals: reprojection errors over time, by class and by track, held-out errors, and distances of landmarks."""

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from fgbaseline import compare
from fgbaseline.data import Excluded, Problem
from fgbaseline.data.problem import WRONG_MATCH
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray

from ..formatting import RESOLUTION
from .comparison_data import ComparisonData
from .layout import title_and_legend
from .over_time import Panel, time_panels
from .panels import fit_log, intervals, log_where_positive, plot_series, running_median, smoothed, swatch, time_axis
from .run_data import RunData
from .style import GRAY, GREEN, SCREEN, Line, Style, label, safe_text, stacked_panels

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.estimate_comparison import Run

SMALL_ERROR = 3.0
"""px, a column of the tables"""
BANDS: Mapping[str, tuple[str, tuple[Excluded, ...]]] = {
    "not masked": ("#b8c4d0", (Excluded.NO,)),
    "feature not chosen": ("#eef1f4", (Excluded.FEATURE_NOT_CHOSEN,)),
    "disparity too small, or track too short": ("#e9e4cf", (Excluded.DISPARITY, Excluded.SHORT)),
    "copied from the previous frame": ("#d9b3e0", (Excluded.COPIED,)),
    "used for the start": ("#a9d3b5", (Excluded.START,)),
    "wrong match, moved or undetermined": ("#c0392b", WRONG_MATCH),
}
"""colors of the observations of a frame, and the reasons for exclusion that each stands for; every reason has one"""
GRID = np.geomspace(0.05, 2000.0, 300)
"""px, where the distribution is drawn"""
RATIOS = np.geomspace(1e-3, 100.0, 200)
"""chi-square of a track per degree of freedom, where the expected distribution is drawn"""
HEAT = "Blues"
"""color map of lightness, which color-blind readers can read too"""
DASHED: Mapping[str, Any] = {"linewidth": 1.0, "linestyle": (0, (2, 1.5))}
CLASSES = {"distance": "by distance", "track age": "by age of the track, frames"}


def reprojection_over_time(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Median error of each frame, on screen above the numbers of observations; None without any."""
    if not style.titled:
        panel = Panel("median error, px", "reprojection_median", 1.2, decades=5.0, smooth=True)
        return time_panels(run, [panel], "", style)
    if run.run is None or len(run.run.problem.sequence.observations) == 0:
        return None
    figure, (upper, lower) = stacked_panels(5.6, 2, height_ratios=[2, 1])
    medians = {name: running_median(values) for name, values in run.column("reprojection_median").items()}
    handles = plot_series(upper, run.t, medians, run.line(), linewidth=1.0)
    fit_log(upper, medians)
    _mark_small_error(upper, vertical=False)
    upper.set(ylabel="median error, px", title=smoothed(len(run.t)))
    counts = observations_by_frame(run.run.problem)
    colors = [BANDS[name][0] for name in counts]
    lower.stackplot(run.t, *counts.values(), colors=colors, linewidth=0, step="post", rasterized=True)
    lower.set(ylabel="observations per frame", ylim=(0, None))
    time_axis([upper, lower], run.t)
    bands = [swatch(BANDS[name][0], name) for name in counts if counts[name].any()]
    title_and_legend(figure, "Median reprojection error by frame, and the observations", [*handles, *bands])
    return figure


def reprojection_distribution(run: RunData) -> Figure | None:
    """Share of observations below a reprojection error, for each estimator; None without any."""
    tables = {r.name: r.reprojection for r in run.answered if len(r.reprojection)}
    if not tables:
        return None
    used = {name: table.loc[table["used"], "error"] for name, table in tables.items()}
    figure = distribution(
        {name: table["error"] for name, table in tables.items()},
        {name: errors for name, errors in used.items() if len(errors)},
        run.line(),
        ("all observations", "used observations"),
    )
    _mark_small_error(figure.axes[0], vertical=True)
    return figure


def distribution(
    errors: Mapping[str, "pd.Series[float]"],
    dashed: Mapping[str, "pd.Series[float]"],
    line: Line,
    labels: Iterable[str],
) -> Figure:
    """Shares of `errors` and, in dashed lines, of others of the same names, by their limit; `labels` are of both."""
    figure, (axes,) = stacked_panels(4.2)
    handles: list[Any] = []
    for name, known in errors.items():
        handles += axes.plot(GRID, 100.0 * share_within(known, GRID), **{**line(name), "linestyle": "solid"})
        if name in dashed:
            axes.plot(GRID, 100.0 * share_within(dashed[name], GRID), **{**line(name), **DASHED, "label": None})
    ends = [np.nanpercentile(known, (1, 99)) for known in errors.values() if known.notna().any()]
    first, last = min((e[0] for e in ends), default=0.5), max((e[1] for e in ends), default=30.0)
    shown = float(np.clip(first, GRID[0], 0.5)), float(np.clip(last, 30.0, GRID[-1]))
    axes.set(xscale="log", xlim=shown, ylim=(0.0, 101.0))
    axes.set(xlabel="reprojection error, px (norm of the four differences)", ylabel="share of observations, %")
    for text, look in zip(labels, ({}, DASHED), strict=False):
        handles += axes.plot([], [], color=GRAY, label=text, **look)
    title_and_legend(figure, "Share of observations below a reprojection error", handles)
    return figure


def reprojection_classes(run: RunData) -> Figure | None:
    """Median error of each class, and chi-square of the tracks beside that of the noise as assumed."""
    classes = _classes(run)
    if run.run is None or not classes:
        return None
    figure = Figure(figsize=(SCREEN.width, 3.8))
    panels = figure.subplots(1, 3).ravel()
    handles: list[Any] = []
    for panel, (by, title) in zip(panels, CLASSES.items(), strict=False):
        tables = {n: c.loc[c["by"] == by].set_index("of")["median"] for n, c in classes.items()}
        handles += medians_by_class(panel, tables, run.line())
        panel.set_title(title)
        log_where_positive(panel)
    panels[0].set_ylabel("median error, px")
    handles += _track_chi_square(panels[2], run.run, list(classes), run.line())
    title_and_legend(figure, "Reprojection errors by class, and chi-square of the tracks", handles)
    return figure


def image_regions(run: RunData) -> Figure | None:
    """Median error in each ninth of the image as a map of 3 x 3, a panel for each estimator; None without any."""
    maps = {name: _ninths(table) for name, table in _classes(run).items()}
    positive = np.concatenate([m[m > 0.0] for m in maps.values()] or [np.empty(0)])
    if len(positive) == 0:
        return None
    columns = min(5, len(maps))
    rows = -(-len(maps) // columns)
    figure = Figure(figsize=(SCREEN.width, 0.75 + 1.25 * rows))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    scale = LogNorm(float(positive.min()), 1.001 * float(positive.max()))
    for panel, (name, medians) in zip(panels, maps.items(), strict=False):
        panel.imshow(medians, cmap=HEAT, norm=scale, aspect="auto")
        for (row, column), value in np.ndenumerate(medians):
            if np.isfinite(value):
                color = "white" if value > 0.0 and scale(value) > 0.55 else "black"
                text = f"{value:#.3g}".rstrip(".")
                panel.text(column, row, text, ha="center", va="center", fontsize=8, color=color)
        panel.set_title(label(name, run.reference), fontsize=9)
        panel.set(xticks=[], yticks=[])
        panel.grid(visible=False)
    for panel in panels[len(maps) :]:
        panel.set_visible(False)
    title_and_legend(figure, "Median reprojection error by place in the left image, px")
    return figure


def _classes(run: RunData) -> "dict[str, pd.DataFrame]":
    """Median errors by class of each estimator that has any: see `compare.residual_patterns`."""
    return {r.name: r.evidence.patterns for r in run.answered if len(r.evidence.patterns)}


def _ninths(classes: "pd.DataFrame") -> FloatArray:
    """Median errors (3, 3) of the ninths of the image; NaN for one without an observation."""
    from fgbaseline.compare.residuals.residual_classes import REGION, REGION_COLUMNS, REGION_ROWS

    medians = classes.loc[classes["by"] == REGION].set_index("of")["median"]
    ninths = [f"{row} {column}" for row in REGION_ROWS for column in REGION_COLUMNS]
    return medians.reindex(ninths).to_numpy(np.float64).reshape(3, 3)


def short(text: str) -> str:
    """Name of a class as a tick has room for it: `5 to 10 m` is 5–10 m."""
    return text.replace(" and more", "+").replace(" to ", "–")


def medians_by_class(
    panel: Axes,
    tables: Mapping[str, "pd.Series[float]"],
    line: Line,
    style: Style = SCREEN,
    label: Callable[[str], str] = short,
) -> list[Any]:
    """Draws medians of classes that index each series; classes are in the order of the longest one."""
    names: dict[str, None] = {}
    for table in sorted(tables.values(), key=len, reverse=True):
        names |= dict.fromkeys(map(str, table.index))
    place = {name: i for i, name in enumerate(names)}
    look: dict[str, Any] = {"marker": "o", "markersize": 3.5} if style.titled else {}
    handles: list[Any] = []
    for name, table in tables.items():
        at = np.array([place[str(of)] for of in table.index])
        order = np.argsort(at)
        handles += panel.plot(at[order], table.to_numpy()[order], **{**line(name), **look})
    turned: dict[str, Any] = {"rotation": 30, "ha": "right", "fontsize": 8} if style.titled else {}
    panel.set_xticks(range(len(names)), [label(name) for name in names], **turned)
    return handles


def observations_by_frame(problem: Problem) -> dict[str, FloatArray]:
    """Numbers of observations per frame (T,), by the names of BANDS; their sum is that of all observations."""
    frame, excluded = problem.sequence.observations.frame, problem.excluded
    return {
        name: np.bincount(frame[np.isin(excluded, reasons)], minlength=problem.n_frames).astype(np.float64)
        for name, (_, reasons) in BANDS.items()
    }


def share_within(errors: "pd.Series[float]", limits: FloatArray) -> FloatArray:
    """Shares (m,) of errors (n,) that are at most each of the limits (m,), of all errors, unknown ones included."""
    known = np.sort(errors.dropna().to_numpy(dtype=np.float64))
    return np.searchsorted(known, limits, side="right") / max(1, len(errors))


def _track_chi_square(panel: Axes, run: "Run", names: Iterable[str], line: Line) -> list[Any]:
    """Share of tracks whose chi-square per degree of freedom is at most x, over x, and what is expected."""
    degrees = np.empty(0)
    for name in names:
        rows = compare.evaluated_rows(run.problem, run.results[name].reprojection)
        tracks = compare.track_chi_square(run.problem, rows)
        degrees = np.concatenate([degrees, tracks["degrees"].to_numpy(dtype=np.float64)])
        ratio = np.sort((tracks["squared"] / tracks["degrees"]).to_numpy(dtype=np.float64))
        share = np.arange(1, len(ratio) + 1) / max(1, len(ratio))
        panel.plot(ratio, 100.0 * share, **{**line(name), "label": None})
    each, counts = np.unique(degrees, return_counts=True)
    expected = 1.0 - compare.p_value(RATIOS[:, None] * each, each) @ counts / max(1, len(degrees))
    look: dict[str, Any] = {"color": GREEN, "linewidth": 1.0, "linestyle": ":", "label": "noise as assumed"}
    drawn = panel.plot(RATIOS, 100.0 * expected, **look)
    panel.set(xscale="log", xlim=(RATIOS[0], RATIOS[-1]), ylim=(0.0, 101.0), title="tracks by chi-square")
    panel.set(xlabel="chi-square per degree of freedom", ylabel="share of tracks, %")
    return list(drawn)


def _mark_small_error(axes: Axes, *, vertical: bool) -> None:
    style: dict[str, Any] = {"color": "#888888", "linewidth": 0.9, "linestyle": ":", "zorder": 1.8}
    letters: dict[str, Any] = {"fontsize": 8.5, "color": GRAY, "ha": "left"}
    if vertical:
        axes.axvline(SMALL_ERROR, **style)
        axes.text(SMALL_ERROR, 0.02, " 3 px", transform=axes.get_xaxis_transform(), va="bottom", **letters)
    else:
        axes.axhline(SMALL_ERROR, **style)
        axes.text(1.003, SMALL_ERROR, "3 px", transform=axes.get_yaxis_transform(), va="center", **letters)


def map_difference(data: RunData | ComparisonData, style: Style = SCREEN) -> Figure | None:
    """Median distance of landmarks from the reference's by depth; None where none is shared.

    In meters and sigmas, on paper only in the camera frame. Another solver of the reference's graph has no distance in
    sigmas: P - P_ref is zero up to rounding.
    """
    if not data.by_depth:
        return None
    from fgbaseline.compare.estimate_comparison import SAME_GRAPH  # pandas and scipy, which files alone do without

    tables = {
        name: table.assign(sigmas=np.nan) if {name, data.reference} <= set(SAME_GRAPH) else table
        for name, table in data.by_depth.items()
    }
    columns = {"distance": "in the world, m", "seen": "in the camera frame, m", "sigmas": "in the world, sigmas"}
    if not style.titled:
        columns = {"seen": ""}
    shown = {c: title for c, title in columns.items() if any(t[c].notna().any() for t in tables.values())}
    if not shown:
        return None
    line = data.line(style, max(map(len, tables.values())))
    figure = Figure(figsize=(style.width, 3.4 if style.titled else 1.7))
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    handles = []
    for panel, (column, title) in zip(panels, shown.items(), strict=True):
        medians = {name: table[column] for name, table in tables.items()}
        handles += medians_by_class(panel, medians, line, style, _depth)
        log_where_positive(panel)
        if column != "sigmas" and panel.get_yscale() == "log" and panel.get_ylim()[1] > RESOLUTION:
            panel.set_ylim(bottom=max(RESOLUTION, panel.get_ylim()[0]))
        panel.set(title=title, xlabel="depth, m")
    if not style.titled:
        panels[0].set_ylabel("distance, m")
    title = f"Landmarks: median distance from those of {safe_text(data.reference or '')}, by depth"
    title_and_legend(figure, title, handles, style)
    return figure


def _depth(name: str) -> str:
    return short(name.replace(" m and more", "+")).removesuffix(" m")


def held_out(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Median error of each path on held-out tracks, with its 95 % interval, best on top; None without any."""
    table = run.held_out
    if table is None:
        return None
    n, colors = len(table), run.colors
    figure = Figure(figsize=(style.width, 1.5 + 0.36 * n if style.titled else 0.6 + 0.2 * n))
    panel = figure.subplots()
    names = [str(name) for name in table["estimator"]]
    low, median, high = (table[column].to_numpy(dtype=np.float64) for column in ("low", "median", "high"))
    rows = zip(range(n), low, median, high, [colors[name] for name in names], strict=True)
    intervals(panel, rows, *((6.0, 2.2) if style.titled else (3.5, 1.6)))
    panel.set_yticks(range(n), [safe_text(name) for name in names])
    panel.set_ylim(n - 0.4, -0.6)
    if style.titled and 0.0 < float(median.min()) < 0.2 * float(median.max()) < np.inf:
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlabel("median held-out error, px" + (", with its 95 % interval" if style.titled else ""))
    held = None if run.run is None else run.run.held_out
    pieces = 0 if held is None or held.errors is None else held.errors.inliers
    title = f"Held-out error: {plural(pieces, 'piece')} of tracks that no estimator used"
    title_and_legend(figure, title, style=style)
    return figure
