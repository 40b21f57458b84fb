"""Reprojection errors: over time with the matches they rest on, and as a distribution."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.compare import reprojection_by
from fgbaseline.data import Excluded, Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Run

from .frames import fit_log, seconds, time_axis
from .style import head, line, sheet, swatch

NEAR = 3.0
"""px: what the tables count as explained"""
WRONG = (Excluded.ROWS, Excluded.PREDICTION, Excluded.GEOMETRY, Excluded.MOVING)
"""reasons that say a match is wrong, its point not standing, or the velocities wrong that carry the track along"""
COARSE = (Excluded.DISPARITY, Excluded.SHORT)
"""reasons that say a match tells little"""
BANDS = {"in the problem": "#b8c4d0", "too far or track too short": "#e9e4cf", "contradict their track": "#c0392b"}
GRID = np.geomspace(0.05, 2000.0, 300)
"""px, where the distribution is drawn"""


def reprojection_over_time(run: Run) -> Figure | None:
    """The median error of each frame, over how many matches there were and why some take no part; None without any."""
    if len(run.problem.sequence.observations) == 0:
        return None
    t = seconds(run)
    figure, (upper, lower) = sheet(5.6, 2, height_ratios=[2, 1])
    medians = {r.name: median_by_frame(r.reprojection, run.problem.n_frames) for r in run.answered}
    handles = []
    for result in run.answered:
        if np.isfinite(medians[result.name]).any():
            handles += upper.plot(t, medians[result.name], **{**line(run, result), "linewidth": 1.0})
    fit_log(upper, medians)
    _mark_near(upper, vertical=False)
    upper.set_ylabel("median error, px")
    counts = matches_by_frame(run.problem)
    colours = [BANDS[name] for name in counts]
    lower.stackplot(t, *counts.values(), colors=colours, linewidth=0, step="post", rasterized=True)
    lower.set_ylabel("matches per frame")
    lower.set_ylim(bottom=0)
    time_axis(run, [upper, lower])
    bands = [swatch(BANDS[name], name) for name in counts if counts[name].any()]
    head(figure, "Reprojection error by frame, and the matches it rests on", [*handles, *bands])
    return figure


def reprojection_distribution(run: Run) -> Figure | None:
    """The share of observations that each estimator explains to within so many pixels; None without any."""
    tables = {r.name: r.reprojection for r in run.answered if len(r.reprojection)}
    if not tables:
        return None
    figure, (axes,) = sheet(4.2)
    handles = []
    for name, table in tables.items():
        style = line(run, run.results[name])
        handles += axes.plot(GRID, 100.0 * share_within(table["error"], GRID), **style)
        used = table.loc[table["used"], "error"]
        if len(used):
            thin = {**style, "linewidth": 1.0, "linestyle": (0, (2, 1.5)), "label": None}
            axes.plot(GRID, 100.0 * share_within(used, GRID), **thin)
    _mark_near(axes, vertical=True)
    axes.set_xscale("log")
    last = max(float(np.nanpercentile(table["error"], 99)) for table in tables.values())
    axes.set_xlim(GRID[0], float(np.clip(last, 30.0, GRID[-1])))
    axes.set_ylim(0.0, 101.0)
    axes.set_xlabel("reprojection error, px (norm of the four differences)")
    axes.set_ylabel("share of observations, %")
    solid = axes.plot([], [], color="#555555", label="of its landmarks")
    dashed = axes.plot([], [], color="#555555", linewidth=1.0, linestyle=(0, (2, 1.5)), label="those it used")
    head(figure, "Share of the observations explained to within so many pixels", [*handles, *solid, *dashed])
    return figure


def median_by_frame(table: pd.DataFrame, n_frames: int) -> FloatArray:
    """(T,) median error of each frame, px; NaN where it has no observation."""
    median = np.full(n_frames, np.nan)
    if len(table):
        by_frame = reprojection_by(table, "frame")["median"]
        median[by_frame.index.to_numpy()] = by_frame.to_numpy()
    return median


def matches_by_frame(problem: Problem) -> dict[str, FloatArray]:
    """(T,) how many matches each frame has in the problem, too coarse, and contradicting, by the names of BANDS."""
    frame, excluded = problem.sequence.observations.frame, problem.excluded
    reasons = [(Excluded.NO,), COARSE, WRONG]
    return {
        name: np.bincount(frame[np.isin(excluded, reason)], minlength=problem.n_frames).astype(np.float64)
        for name, reason in zip(BANDS, reasons, strict=True)
    }


def share_within(errors: "pd.Series[float]", limits: FloatArray) -> FloatArray:
    """(m,) which share of all errors (n,), unknown ones included, is at most each of the limits (m,)."""
    known = np.sort(errors.dropna().to_numpy(dtype=np.float64))
    return np.searchsorted(known, limits, side="right") / max(1, len(errors))


def _mark_near(axes: Axes, *, vertical: bool) -> None:
    style: dict[str, Any] = {"color": "#888888", "linewidth": 0.9, "linestyle": ":", "zorder": 1.8}
    letters: dict[str, Any] = {"fontsize": 8.5, "color": "#555555"}
    if vertical:
        axes.axvline(NEAR, **style)
        axes.text(NEAR, 0.02, " 3 px", transform=axes.get_xaxis_transform(), ha="left", va="bottom", **letters)
    else:
        axes.axhline(NEAR, **style)
        axes.text(1.003, NEAR, "3 px", transform=axes.get_yaxis_transform(), ha="left", va="center", **letters)
