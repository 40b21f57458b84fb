"""Page of a comparison."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from matplotlib.figure import Figure

from fgbaseline.compare.trajectory_comparison.comparison import Comparison

from ..figures.comparison_data import of_comparison
from ..figures.saving import EncodedFigure
from ..formatting import counted, listed, number
from ..phrases.comparison import verdict
from ..results.comparison import Summary
from ..tables.comparison import comparison_table
from ..tables.table import Row
from .comparison_plots import comparison_plots
from .page import Folded, Grid, Live, Page, Section, figure_blocks, pictures, still_figures, trust
from .rendering import render_page

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


def render(comparison: Comparison, summary: Summary, figures: Mapping[str, Figure | EncodedFigure]) -> str:
    """`report.html` of a comparison."""
    settings = {name: value for name, value in summary.settings.items() if value is not None}
    reference, estimates, data = summary.reference, summary.estimates, of_comparison(comparison)
    table = comparison_table(comparison, summary.by_name, summary.caption, mark_reference=True)
    drawn = pictures(figures, CAPTIONS)
    notes = {name: estimate.notes for name, estimate in estimates.items() if estimate.notes}
    sources = {reference.name: reference.source, **{name: estimate.source for name, estimate in estimates.items()}}
    bands = [p for name, p in drawn.items() if name.startswith("three_sigma_")]
    beyond = [p for name, p in drawn.items() if not name.startswith((*STILLS, "growth", "three_sigma_"))]
    stills = figure_blocks(drawn, STILLS)
    grid = Grid(
        replace(
            table,
            name="metric",
            caption=f"{table.caption} {BEST[comparison.ranking.same]}",
            rows=tuple(_with_intervals_below(row) for row in table.rows),
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
                Section(
                    "over-time",
                    "Over time",
                    [Live("charts"), *figure_blocks(drawn, ["growth"])],
                ),
                Section(
                    "evidence",
                    _beyond_title(drawn, bool(bands)),
                    [*beyond, *folded],
                ),
                Section("stills", "Static figures", [still_figures(stills)] if stills else []),
            ],
            settings={"Missing values": _named(notes), "Files": sources, "Settings": settings},
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


def _named(notes: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """The notes of all estimates, by estimate and the words for their keys."""
    every = ((name, key, why) for name, of in notes.items() for key, why in of.items())
    return {f"{name}: {ABSENT.get(key, key.replace('_', ' '))}": why for name, key, why in every}


def _with_intervals_below(row: Row) -> Row:
    """The row with each interval on a line below its value."""
    return replace(row, cells=tuple(cell._replace(text=cell.text.replace(" [", "\n[")) for cell in row.cells))
