"""Reprojection errors of a comparison, as a distribution."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..figures.reprojections import GRID, share_within
from ..figures.style import head, sheet
from ..trajectories.comparison import Comparison
from ..trajectories.reprojection import Pixels
from .lines import line

THIN: Mapping[str, Any] = {"linewidth": 1.0, "linestyle": (0, (2, 1.5))}


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
        style = line(comparison, name)
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
