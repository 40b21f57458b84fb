"""Maps beside the reference's, and paths judged by tracks that none of them has seen."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from fgbaseline.compare import map_by_depth
from fgbaseline.data.plural import plural
from fgbaseline.reports.comparison import Run

from .frames import log_where_positive
from .lettering import plain
from .palette import colours
from .style import head, line

FEWEST = 10
"""landmarks of a class that a median in sigmas is shown for: few of them have a covariance of the difference"""


def map_difference(run: Run) -> Figure | None:
    """Median distance of landmarks from the reference's by depth, in metres and sigmas; None where none is shared."""
    maps = {r.name: r.evidence.map for r in run.answered}
    known = {name: m for name, m in maps.items() if m is not None and len(m)}
    return maps_by_depth(known, {n: line(run, run.results[n]) for n in known}, run.reference or "")


def maps_by_depth(
    maps: Mapping[str, pd.DataFrame], styles: Mapping[str, Mapping[str, Any]], reference: str
) -> Figure | None:
    """The same of tables of `compare.map_difference` by name, with the line of each."""
    tables = {name: map_by_depth(m) for name, m in maps.items()}
    for table in tables.values():
        table["sigmas"] = table["sigmas"].where(table["with_sigmas"] >= FEWEST)
    if not tables:
        return None
    columns = {"distance": "in the world, m", "seen": "as seen by the cameras, m", "sigmas": "in the world, sigmas"}
    shown = {c: title for c, title in columns.items() if any(t[c].notna().any() for t in tables.values())}
    figure = Figure(figsize=(8.0, 3.4))
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    handles: list[Any] = []
    for panel, (column, title) in zip(panels, shown.items(), strict=True):
        for name, table in tables.items():
            style = {**styles[name], "marker": "o", "markersize": 3.5}
            handles += panel.plot(np.arange(len(table)), table[column].to_numpy(), **style)
        labels = [str(of).replace(" m and more", "+").replace(" to ", "–").removesuffix(" m") for of in table.index]
        panel.set_xticks(range(len(labels)), labels, rotation=30, ha="right", fontsize=8)
        log_where_positive(panel)
        panel.set_title(title)
        panel.set_xlabel("depth, m")
    head(figure, f"Landmarks: median distance from those of {plain(reference)}, by depth", handles)
    return figure


def held_out(run: Run) -> Figure | None:
    """The median error of each path on held-out tracks, with its 95 % interval, best on top; None without any."""
    if run.held_out is None or len(run.held_out.ranking) == 0:
        return None
    ranking = run.held_out.ranking
    figure = Figure(figsize=(8.0, 1.5 + 0.36 * len(ranking)))
    panel = figure.subplots()
    colour = colours(run)
    rows = np.arange(len(ranking))
    for row, name in zip(rows, ranking.index, strict=True):
        low, high, median = (float(ranking[c].to_numpy()[row]) for c in ("low", "high", "median"))
        panel.plot([low, high], [row, row], color=colour[name], linewidth=2.2, solid_capstyle="butt")
        panel.plot([median], [row], marker="o", markersize=6, color=colour[name])
    panel.set_yticks(rows, [plain(str(name)) for name in ranking.index])
    panel.invert_yaxis()
    panel.set_ylim(len(ranking) - 0.4, -0.6)
    if 0.0 < float(ranking["median"].min()) < 0.2 * float(ranking["median"].max()) < np.inf:
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(axis="y", visible=False)
    panel.set_xlabel("median error on held-out tracks, px, with its 95 % interval")
    n = 0 if run.held_out.errors is None else run.held_out.errors.inliers
    head(figure, f"Predicting tracks that no estimator saw: {plural(n, 'piece')} of tracks, the same for all")
    return figure
