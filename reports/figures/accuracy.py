"""Accuracy without truth by held-out tracks and landmarks of the reference, and where a failed check parts from it."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from fgbaseline.compare import MatchedTrajectories
from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.plural import plural
from fgbaseline.geometry import FloatArray

from .panels import Line, intervals, log_where_positive, short
from .reprojection import medians_by_class
from .run_data import RunData
from .style import SCREEN, TRUTH, Style, head, in_style, plain

FEWEST = 10
"""landmarks of a class that a median in sigmas is shown for: few of them have a covariance of the difference"""
COLORS = {"ate": "#0072b2", "divergence": "#d55e00"}
LABELS = {"ate": "aligned", "divergence": "not aligned"}


def map_difference(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Median distance of landmarks from the reference's by depth; None where none is shared."""
    if not run.by_depth:
        return None
    classes = max(map(len, run.by_depth.values()))
    return maps_by_depth(run.by_depth, run.line(style, classes), run.reference or "", style)


def maps_by_depth(
    tables: Mapping[str, pd.DataFrame], line: Line, reference: str, style: Style = SCREEN
) -> Figure | None:
    """Tables of `compare.map_by_depth` by name: in metres and sigmas, on paper only as the cameras see them."""
    columns = {"distance": "in the world, m", "seen": "as seen by the cameras, m", "sigmas": "in the world, sigmas"}
    if style.titled:
        tables = {n: t.assign(sigmas=t["sigmas"].where(t["with_sigmas"] >= FEWEST)) for n, t in tables.items()}
    else:
        columns = {"seen": ""}
    shown = {c: title for c, title in columns.items() if any(t[c].notna().any() for t in tables.values())}
    if not shown:
        return None
    figure = Figure(figsize=(style.width, 3.4 if style.titled else 1.7))
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    handles = []
    for panel, (column, title) in zip(panels, shown.items(), strict=True):
        medians = {name: table[column] for name, table in tables.items()}
        handles += medians_by_class(panel, medians, line, style, _depth)
        log_where_positive(panel)
        panel.set_title(title)
        panel.set_xlabel("depth, m")
    if not style.titled:
        panels[0].set_ylabel("distance, m")
    head(figure, f"Landmarks: median distance from those of {plain(reference)}, by depth", handles, style)
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
    panel.set_yticks(range(n), [plain(name) for name in names])
    panel.set_ylim(n - 0.4, -0.6)
    if style.titled and 0.0 < float(median.min()) < 0.2 * float(median.max()) < np.inf:
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlabel("median error on held-out tracks, px" + (", with its 95 % interval" if style.titled else ""))
    pieces = 0 if run.observed is None else run.observed.held_out_tracks
    title = f"Predicting tracks that no estimator saw: {plural(pieces, 'piece')} of tracks, the same for all"
    head(figure, title, style=style)
    return figure


def draw(aligned: MatchedTrajectories, errors: Mapping[str, tuple[pd.DataFrame, float | None]], path: Path) -> None:
    """Draws into the PNG `path`, whose folder is made: both paths, and each table's `translation` with its bound.

    `errors` has the tables of `absolute_errors` by what was aligned, and the largest distance allowed, m.
    """
    with in_style():
        figure = Figure(figsize=(SCREEN.width, 7.0))
        above, below = figure.subplots(2, 1, height_ratios=(2, 1))
        _paths(above, aligned)
        for name, (table, largest) in errors.items():
            below.plot(table["t"] - table["t"].iloc[0], table["translation"], color=COLORS[name], label=LABELS[name])
            if largest is not None:
                below.axhline(largest, color=COLORS[name], linestyle=(0, (4, 2)), linewidth=1.0)
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


def _paths(axes: Axes, aligned: MatchedTrajectories) -> None:
    plane = widest_plane(aligned.reference.position)
    here = aligned.reference.position @ plane
    axes.plot(*here.T, color=TRUTH, linestyle=(0, (4, 2)), linewidth=1.8, label=plain(aligned.reference.name))
    axes.plot(*(aligned.estimate.position @ plane).T, color=COLORS["ate"], label=plain(aligned.estimate.name))
    axes.plot(*here[0], color=TRUTH, marker="o", linestyle="none", label="start")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="m", ylabel="m", title=f"in the plane in which {plain(aligned.reference.name)} is widest, aligned")
    axes.legend()


def widest_plane(positions: FloatArray) -> FloatArray:
    """(3, 2) orthonormal directions in which positions (n, 3) spread most."""
    _, _, Vt = np.linalg.svd(positions - positions.mean(axis=0), full_matrices=True)
    return np.asarray(Vt[:2].T)
