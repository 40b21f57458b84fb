"""Where the filter breaks and why: over features and noise, as recorded and repaired, and cause by cause."""

from collections.abc import Sequence as Several
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fgbaseline.data import Status
from fgbaseline.data.plural import plural

from ..figures.lettering import plain
from ..figures.style import WIDTH, head
from ..formatting import meters
from .study import Study
from .trial import Outcome, path_length

BROKEN = "#b3261e"
COLOURS = colormaps["cividis_r"]
LEAST, MOST = 1e-3, 1.0
"""shares of the path's length between which the colour goes"""
MAP, BARS = 0.42, 0.24
"""inches for a row of the map and for a bar"""
ROOM = 0.95
"""inches for what stands around a panel"""


def sweep_figure(studies: Several[Study]) -> Figure:
    """For each recording two maps over features and V, and below them the filter of figure 9 cause by cause."""
    heights = [h for s in studies for h in (MAP * _rows(s) + ROOM, BARS * len(s.staged) + ROOM)]
    figure = Figure(figsize=(WIDTH, sum(heights) + 1.0))
    grid = figure.add_gridspec(2 * len(studies), 2, height_ratios=heights)
    for i, study in enumerate(studies):
        for column, (name, outcomes) in enumerate((("as recorded", study.swept), ("repaired", study.swept_repaired))):
            axes = figure.add_subplot(grid[2 * i, column])
            _map(axes, study, outcomes)
            axes.set_title(f"{plain(study.subject.label)}: {name}")
        _bars(figure.add_subplot(grid[2 * i + 1, :]), study)
    frame = Rectangle(
        (0, 0),
        1,
        1,
        fill=False,
        edgecolor=BROKEN,
        linewidth=2.0,
        label=("the printed equations break: frames at which (I - KH)Σ is no covariance"),
    )
    head(figure, "Where the documented filter breaks: distance from dead reckoning (RMS)", [frame])
    return figure


def _rows(study: Study) -> int:
    return len({outcome.settings.pixel_variance for outcome in study.swept})


def _map(axes: Axes, study: Study, outcomes: Several[Outcome]) -> None:
    features = sorted({o.settings.features or 0 for o in study.swept})
    noises = sorted({o.settings.pixel_variance for o in study.swept})
    axes.set_xlim(-0.5, len(features) - 0.5)
    axes.set_ylim(-0.5, len(noises) - 0.5)
    axes.grid(visible=False)
    axes.set_xticks(range(len(features)), [str(n) for n in features])
    axes.set_yticks(range(len(noises)), [f"{v:g}" for v in noises])
    axes.set_xlabel("features")
    axes.set_ylabel("V, px²")
    if not outcomes:
        axes.text(0.5, 0.5, "nothing to repair was found", transform=axes.transAxes, ha="center", va="center")
    broken = []
    for o in outcomes:
        x, y = features.index(o.settings.features or 0), noises.index(o.settings.pixel_variance)
        share = o.apart_rmse / path_length(study.predicted)
        level = 1.0 if not np.isfinite(share) else float(np.log(max(share, 1e-9) / LEAST) / np.log(MOST / LEAST))
        colour = COLOURS(np.clip(level, 0.0, 1.0))
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=colour, edgecolor="white", linewidth=0.6))
        if o.breaks:
            broken.append(Rectangle((x - 0.46, y - 0.44), 0.92, 0.88, fill=False, edgecolor=BROKEN, linewidth=2.0))
        light = sum(w * c for w, c in zip((0.3, 0.59, 0.11), colour[:3], strict=True)) > 0.5
        axes.text(x, y, _told(o), ha="center", va="center", fontsize=7, color="black" if light else "white")
    for frame in broken:
        axes.add_patch(frame)


def _told(outcome: Outcome) -> str:
    if outcome.status is Status.FAILED:
        return "stops"
    return meters(outcome.apart_rmse) + (f"\n{plural(outcome.lost, 'frame')}" if outcome.lost else "")


def _bars(axes: Axes, study: Study) -> None:
    """RMS distance from dead reckoning after each repair."""
    values = [staged.outcome.apart_rmse for staged in study.staged]
    rows = range(len(values))
    style: dict[str, Any] = {"height": 0.62, "color": "#7a8794"}
    axes.barh(rows, np.nan_to_num(values), **style)
    axes.set_yticks(rows, [staged.stage.name for staged in study.staged])
    axes.invert_yaxis()
    axes.set_xscale("log")
    finite = [v for v in values if np.isfinite(v) and v > 0] or [1.0]
    axes.set_xlim(min(finite) / 3.0, max(finite) * 100.0)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("m from dead reckoning (RMS)")
    for row, staged in zip(rows, study.staged, strict=True):
        o = staged.outcome
        lost = f", lost at {plural(o.lost, 'frame')}" if o.lost else ""
        text = f" {meters(o.apart_rmse)}, {o.reprojection:.3g} px median, {100 * o.behind:.2g} % behind{lost}"
        x = o.apart_rmse if np.isfinite(o.apart_rmse) else min(finite) / 3.0
        axes.text(x, row, text, va="center", fontsize=8, color=BROKEN if o.breaks else "#222222")
    shown = study.recorded.settings
    axes.set_title(f"Cause by cause, N = {shown.features}, V = {shown.pixel_variance:g} I")
