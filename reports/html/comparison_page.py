"""Page of a comparison, and the data of its plots in the form of a run's (see `plot_data.page_data`)."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from fgbaseline import compare
from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.compare.trajectory_comparison.inputs import Entry
from fgbaseline.geometry import FloatArray

from ..figures.comparison_data import ComparisonData, of_comparison
from ..figures.drawing import EncodedFigure
from ..figures.panels import DEGREES_OF_FREEDOM
from ..formatting import counted, distance, listed, number
from ..phrases.comparison import verdict
from ..results.comparison import Summary
from ..tables.comparison import comparison_table
from ..tables.table import Cell
from .page import Folded, Grid, Live, Page, Section, figure_blocks, pictures, render_page, still_figures, trust
from .plot_encoding import Chart, Lines, chart, expected, floats, grouped, integers, numbered, position_covariances

CAPTIONS: Mapping[str, str] = {
    "paths": "Aligned as the caption of the table describes, seen from above.",
    "errors": "Differences of paired poses along the reference's direction of travel, to its left and up.",
    "growth": "A heading error to the left is positive. An alignment over all poses spreads the error over all of "
    "them; --align first-pose shows how it grows.",
    "relative": "Boxes hold the middle half of the errors, whiskers reach from 5 to 95 %. The line is the median, the "
    "diamond the RMSE of the table. Relative errors do not depend on alignment or on earlier errors.",
    "segments": "Mean error over all segments of a length, divided by the length.",
    "map": "Landmarks are matched by index. Distances in the world include the drift of the trajectories; those in the "
    "camera frames do not.",
    "three_sigma": "Error of each pose in its own body frame with ±3-sigma bounds of its covariance; both are "
    "relative to the first pose where an alignment was requested and the covariances grow from there.",
    "reprojection": "Solid with landmarks triangulated along each trajectory, dotted with the landmarks of the "
    "estimate.",
}
"""captions by the beginning of a figure's name"""
BEST = {
    True: "Best of a row in bold.",
    False: "Best of a row in bold, only where the row is over the same poses of all estimates.",
}
"""by whether all estimates have the same stamps"""
ABSENT: Mapping[str, str] = {"nees": "NEES", "passing": "first pose above the threshold", "map": "map difference"}
"""words for keys of missing values that do not explain themselves"""
STILLS = ("paths", "errors")
"""figures that show what the interactive plots show"""
MOMENTS = 4000
"""largest number of positions of the slider"""
REFERENCE_MOMENTS = 1000
"""poses of the reference among them, at most, where no estimate has a pair"""
GAP = 10.0
"""usual intervals of an estimate without a pose, from which on its line is broken"""


def render(comparison: Comparison, summary: Summary, figures: Mapping[str, Figure | EncodedFigure]) -> str:
    """`report.html` of a comparison."""
    settings = {name: value for name, value in summary.settings.items() if value is not None}
    reference, estimates, data = summary.reference, summary.estimates, of_comparison(comparison)
    table = comparison_table(comparison, summary.by_name, summary.caption, mark_reference=True)
    drawn = pictures(figures, CAPTIONS)
    missing = {
        f"{name}: {ABSENT.get(key, key.replace('_', ' '))}": why
        for name, estimate in estimates.items()
        for key, why in estimate.notes.items()
    }
    sources = {reference.name: reference.source, **{name: estimate.source for name, estimate in estimates.items()}}
    bands = [p for name, p in drawn.items() if name.startswith("three_sigma_")]
    beyond = [p for name, p in drawn.items() if not name.startswith((*STILLS, "growth", "three_sigma_"))]
    stills = figure_blocks(drawn, STILLS)
    grid = Grid(
        replace(
            table,
            name="metric",
            caption=f"{table.caption} {BEST[comparison.ranking.same]}",
            rows=tuple(replace(row, cells=tuple(map(_with_interval_below, row.cells))) for row in table.rows),
        )
    )
    behind = None if reference.trust is None else trust(reference.name, reference.trust, reference.reasons)
    folded = [Folded("Errors with ±3-sigma bounds, for each estimate", bands)] if bands else []
    return render_page(
        Page(
            kind="comparison",
            title=f"{', '.join(estimates)} against {reference.name}",
            about=_about(summary),
            verdict=verdict(comparison),
            table=Section("table", "Metrics by estimate", [grid], "Metrics"),
            sections=[
                Section("behind", "Trust in the reference", [behind] if behind is not None else []),
                Section("over-time", "Over time", [Live("charts"), *figure_blocks(drawn, ["growth"])]),
                Section("evidence", _beyond_title(drawn, bool(bands)), [*beyond, *folded]),
                Section("stills", "Static figures", [still_figures(stills)] if stills else []),
            ],
            settings={"Missing values": missing, "Files": sources, "Settings": settings},
            colors=data.colors,
            plots=comparison_plots(comparison, data),
            still_paths=drawn.get("paths"),
        )
    )


def _about(summary: Summary) -> str:
    reference = summary.reference
    lasting = "" if reference.duration_s is None else f" in {number(reference.duration_s)} s"
    paired = all(e.pairing.pairs == e.poses == reference.poses for e in summary.estimates.values())
    interpolated = "" if paired else " Lines are interpolated between the poses of an estimate."
    pixels = "" if summary.sequence is None else f" Reprojection is of the observations of {summary.sequence}."
    return (
        f"The reference has {counted(reference.poses, 'pose')}{lasting} along {number(reference.path_m)} m.{pixels}"
        f"{interpolated}"
    )


def _beyond_title(names: Iterable[str], has_bands: bool) -> str:
    """Title of the section below the charts, from the figures that it has."""
    of = {"relative": "relative errors", "segments": "segment errors", "map": "map", "reprojection": "reprojection"}
    parts = [text for beginning, text in of.items() if any(name.startswith(beginning) for name in names)]
    title = listed([*parts, *(["±3-sigma bounds"] if has_bands else [])])
    return title[:1].upper() + title[1:]


def _with_interval_below(cell: Cell) -> Cell:
    """Cell with its interval on a line below its value."""
    return cell._replace(text=cell.text.replace(" [", "\n["))


def comparison_plots(comparison: Comparison, data: ComparisonData) -> dict[str, Any]:
    """Everything at the moments of the pairs of poses, between which an estimate is interpolated as a line is drawn."""
    own = np.asarray(comparison.reference.trajectory.t - comparison.reference.trajectory.t[0])
    t = _moments(data, own)
    lines = {data.reference: _at(t, own, data.paths[data.reference])}
    lines |= {name: _at(t, data.t[name], data.paths[name]) for name in data.names}
    entries: dict[str, tuple[Entry, Result | None]] = {data.reference: (comparison.reference, None)}
    entries |= {name: (result.entry, result) for name, result in comparison.results.items()}
    start = comparison.reference.trajectory.position[0]
    return {
        "frames": len(t),
        "step": "stamp" if data.stamped else "frame",
        "stamped": data.stamped,
        "axes": list(data.axes),
        "t": floats(t),
        "reference": data.reference,
        "estimators": [_estimator(data, *of, lines[name], t, start) for name, of in entries.items()],
        "truth": None,
        "camera": None,
        "observations": None,
        "reasons": {},
        "charts": _charts(comparison, data, t, lines),
        "bookmarks": _bookmarks(comparison, data, t),
    }


def _moments(data: ComparisonData, own: FloatArray) -> FloatArray:
    """Times of all pairs and of some of the reference's poses; evenly thinned where they are too many."""
    some = own[:: -(-len(own) // REFERENCE_MOMENTS)]
    t = np.unique(np.concatenate([some, own[-1:], *data.t.values()]))
    return np.asarray(t[:: -(-len(t) // MOMENTS)])


def _at(t: FloatArray, known: FloatArray, values: ArrayLike) -> FloatArray:
    """Values (n,) or (n, d) of rising times `known` (n,) at times t: linear between neighbors, NaN across gaps."""
    every = np.asarray(values, dtype=np.float64)
    after = np.clip(np.searchsorted(known, t), 0, len(known) - 1)
    before = np.where(known[after] == t, after, np.maximum(after - 1, 0))
    span = known[after] - known[before]
    usual = float(np.median(np.diff(known))) if len(known) > 1 else 0.0
    inside = (t >= known[0]) & (t <= known[-1]) & (span <= GAP * usual)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(span > 0, (t - known[before]) / span, 0.0)
    share, inside = (part.reshape(-1, *[1] * (every.ndim - 1)) for part in (share, inside))
    return np.where(inside, every[before] + share * np.where(share > 0, every[after] - every[before], 0.0), np.nan)


def _estimator(
    data: ComparisonData, entry: Entry, result: Result | None, path: FloatArray, t: FloatArray, start: FloatArray
) -> dict[str, Any]:
    """A trajectory: path, position covariances and landmarks, as far as they came with it."""
    view = data.view
    about: dict[str, Any] = {"name": entry.name, "answered": True, "path": floats(path)}
    about |= {"cameras": None, "covariance": None, "landmarks": None, "points": None, "used": None}
    if result is not None and result.reported_covariance is not None:
        body = np.stack([view.ahead, view.left, view.up]) @ result.matched.estimate.rotation
        P = position_covariances(body, result.reported_covariance.covariance)
        about["covariance"] = floats(_at(t, data.t[entry.name], P))
    if entry.landmarks is not None and len(entry.landmarks):
        points = entry.landmarks.position
        if result is not None:
            motion = result.matched.alignment
            points = motion.scale * points @ motion.rotation.T + motion.translation
        about["landmarks"] = integers(entry.landmarks.index)
        about["points"] = floats(view.scene(points - start))
    return about


def _charts(comparison: Comparison, data: ComparisonData, t: FloatArray, paths: Lines) -> list[Chart]:
    """The charts in their order; those without lines are left out."""
    of, how = data.reference, data.alignment

    def lines(values: Lines) -> Lines:
        return numbered((of, *data.names), values)

    def difference(name: str, title: str, unit: str, column: str) -> Chart | None:
        table = {n: _at(t, data.t[n], table[column]) for n, table in data.series.items()}
        return chart(name, title, unit, lines(table))

    reported = {n: r.reported_covariance for n, r in comparison.results.items()}
    nees = {n: _at(t, data.t[n], covariance.nees) for n, covariance in reported.items() if covariance is not None}
    poses = expected(DEGREES_OF_FREEDOM, "poses of a consistent estimator") if nees else {}  # needs scipy
    heights, medians = {n: path[:, 2] for n, path in paths.items()}, _pixels(comparison, t)
    along = {"log": True, "smooth": True, "hint": "with landmarks triangulated along each path"}
    groups = {
        "Position and rotation": [
            difference("divergence", f"Position error against {of}, {how}", "m", "position"),
            difference("rotation", f"Rotation error against {of}, {how}", "°", "rotation_deg"),
            difference("along", f"Ahead of {of}", "m", "along"),
            difference("across", f"To the left of {of}", "m", "across"),
            difference("above", f"Above {of}", "m", "up"),
            difference("heading", f"Heading error against {of}, left positive", "°", "heading_deg"),
            chart("height", "Height above the reference's start", "m", lines(heights)),
        ],
        "Consistency": [chart("nees", "NEES", "", lines(nees), **poses)],
        "Pixels": [chart("reprojection", "Median reprojection error by frame", "px", lines(medians), **along)],
    }
    return grouped(groups)


def _pixels(comparison: Comparison, t: FloatArray) -> Lines:
    """Median error of each frame, px, with landmarks triangulated along the path."""
    sequence, lines = comparison.sequence, {}
    for name, pixels in comparison.pixels.items():
        if sequence is not None and pixels.along is not None and len(pixels.along):
            medians = compare.reprojection_by(pixels.along, "frame")["median"].reindex(range(sequence.n_frames))
            lines[name] = _at(t, sequence.t - comparison.reference.trajectory.t[0], medians)
    return lines


def _bookmarks(comparison: Comparison, data: ComparisonData, t: FloatArray) -> list[dict[str, Any]]:
    """Moments of the first poses beyond the threshold, and of the largest errors where there is none."""
    found = []
    for name, result in comparison.results.items():
        position = result.divergence["position"]
        first = result.passing is not None
        k = result.passing.frame if result.passing is not None else int(np.nanargmax(position))
        far = result.bound if first else position[k]
        text = f"{name} {'first' if first else 'farthest,'} {distance(far)} from {data.reference}"
        found.append({"frame": int(np.argmin(np.abs(t - data.t[name][k]))), "text": text})
    return sorted(found, key=lambda bookmark: int(bookmark["frame"]))
