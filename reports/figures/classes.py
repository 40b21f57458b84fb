"""Reprojection errors by distance, track age and place in the image, and tracks against chi-square."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.compare import evaluated_rows, track_chi_square
from fgbaseline.reports.comparison import Result, Run

from .frames import log_where_positive
from .style import head, line

CLASSES = {"distance": "by distance", "track age": "by age of the track, sights", "region": "by place in the image"}


def reprojection_classes(run: Run) -> Figure | None:
    """The median error of each class, and the probabilities of tracks, uniform where the noise is as assumed."""
    results = [r for r in run.answered if len(r.evidence.patterns)]
    if not results:
        return None
    figure = Figure(figsize=(8.0, 5.8))
    panels = figure.subplots(2, 2).ravel()
    handles: list[Any] = []
    for panel, (by, title) in zip(panels, CLASSES.items(), strict=False):
        handles += _medians(run, panel, results, by)
        panel.set_title(title)
        log_where_positive(panel)
        panel.set_ylabel("median error, px")
    handles += _probabilities(run, panels[3], results)
    head(figure, "Reprojection errors in classes, and tracks against chi-square", handles)
    return figure


def _medians(run: Run, panel: Axes, results: list[Result], by: str) -> list[Any]:
    tables = {r.name: r.evidence.patterns.loc[r.evidence.patterns["by"] == by].set_index("of") for r in results}
    names: dict[str, None] = {}
    for table in sorted(tables.values(), key=len, reverse=True):
        names |= dict.fromkeys(table.index)
    place = {name: i for i, name in enumerate(names)}
    handles: list[Any] = []
    for name, table in tables.items():
        at = [place[of] for of in table.index]
        order = np.argsort(at)
        style = {**line(run, run.results[name]), "marker": "o", "markersize": 3.5}
        handles += panel.plot(np.asarray(at)[order], table["median"].to_numpy()[order], **style)
    panel.set_xticks(range(len(names)), [_label(by, name) for name in names], rotation=30, ha="right", fontsize=8)
    return handles


def _probabilities(run: Run, panel: Axes, results: list[Result]) -> list[Any]:
    """The share of tracks whose chi-square probability is at most p, over p: the diagonal is what is expected."""
    for result in results:
        tracks = track_chi_square(run.problem, evaluated_rows(run.problem, result.reprojection))
        p = np.sort(tracks["probability"].dropna().to_numpy())
        share = np.arange(1, len(p) + 1) / max(1, len(p))
        panel.plot(p, 100.0 * share, **{**line(run, result), "label": None})
    diagonal = panel.plot([0, 1], [0, 100], color="#6b9a72", linewidth=1.0, linestyle=":", label="noise as assumed")
    panel.set_xlim(0.0, 1.0)
    panel.set_ylim(0.0, 100.0)
    panel.set_xlabel("probability of a track's residuals, or larger")
    panel.set_ylabel("share of tracks, %")
    panel.set_title("by chi-square of each track")
    return list(diagonal)


def _label(by: str, name: str) -> str:
    return name.replace(" and more", "+").replace(" to ", "–") if by != "region" else name
