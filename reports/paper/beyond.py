"""Held-out tracks and maps."""

import numpy as np
from matplotlib.figure import Figure

from ..figures.lettering import plain
from ..figures.palette import colours_of
from .folder import Drawn
from .style import COLUMN, legend, line


def held_out(run: Drawn) -> Figure | None:
    """The median error of each path on held-out tracks with its 95 % interval; None where none were held out."""
    table = run.held_out
    if table is None:
        return None
    colours = colours_of(run.names, run.reference)
    figure = Figure(figsize=(COLUMN, 0.6 + 0.2 * len(table)))
    axes = figure.subplots()
    for row, of in enumerate(table.to_dict("records")):
        name = str(of["estimator"])
        axes.plot([of["low"], of["high"]], [row, row], color=colours[name], linewidth=1.6, solid_capstyle="butt")
        axes.plot([of["median"]], [row], marker="o", markersize=3.5, color=colours[name])
    axes.set_yticks(range(len(table)), [plain(str(name)) for name in table["estimator"]])
    axes.set_ylim(len(table) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("median error on held-out tracks, px")
    return figure


def map_difference(run: Drawn) -> Figure | None:
    """Median distance of landmarks from the reference's, as seen, by depth; None where none is shared."""
    table = run.by_depth
    if table is None or not np.isfinite(table["seen"]).any():
        return None
    depths = list(dict.fromkeys(table["depth"].astype(str)))
    figure = Figure(figsize=(COLUMN, 1.7))
    axes = figure.subplots()
    for name in run.names:
        of = table[table["estimator"] == name]
        if len(of):
            at = [depths.index(depth) for depth in of["depth"].astype(str)]
            axes.plot(at, of["seen"], **line(run, name, len(at)))
    axes.set_yscale("log")
    short = [depth.replace(" m and more", "+").replace(" to ", "–").removesuffix(" m") for depth in depths]
    axes.set_xticks(range(len(depths)), short)
    axes.set(xlabel="depth, m", ylabel="distance, m")
    legend(figure, axes)
    return figure
