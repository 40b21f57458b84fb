"""Page of a comparison, which opens offline."""

from collections.abc import Mapping
from dataclasses import replace

from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.compare.trajectory_comparison.comparison import Comparison

from ..figures.style import colors
from ..phrases.comparison import verdict
from ..phrases.evidence import FIRST
from ..results.comparison import Summary
from ..tables import Row
from ..tables.comparison import Results, comparison_table
from .environment import environment, picture

CAPTIONS: Mapping[str, str] = {
    "paths": "Aligned as the caption of the table describes, seen from above.",
    "errors": "Differences of paired poses along the reference's direction of travel, to its left and up.",
    "growth": "Difference over the length of the path; a heading to the left is positive.",
    "relative": "Boxes hold the middle half, whiskers 5 to 95 %, the line is the median. Relative errors do not "
    "depend on alignment or earlier errors.",
    "segments": "Mean over all segments of a length, per meter.",
    "map": "Landmarks are matched by number. Distances in the world include the drift of the paths; those in the "
    "camera frames do not.",
    "three_sigma": "Error of each pose in its own body frame between three sigmas of its covariance; both are "
    "relative to the first pose where an alignment was requested and the covariances grow from there.",
    "reprojection": "Solid with landmarks triangulated along each path, dotted with the landmarks of the estimate.",
}
"""captions by the beginning of a figure's name"""


def render(comparison: Comparison, results: Results, summary: Summary, figures: Mapping[str, Figure]) -> str:
    """`report.html`. All text that comes from files is escaped."""
    reference, estimates = summary.reference, summary.estimates
    table = comparison_table(comparison, results, summary.caption, mark_reference=True)
    palette = colors([reference.name, *estimates], reference.name)
    titles = {name: f"{name} (reference)" if name == reference.name else name for name in palette}
    notes = {f"Missing figures of {name}": estimate.notes for name, estimate in estimates.items()}
    sources = {reference.name: reference.source, **{name: estimate.source for name, estimate in estimates.items()}}
    return (
        environment()
        .get_template("comparison.html")
        .render(
            summary=summary,
            verdict=verdict(comparison),
            first=FIRST,
            table=replace(
                table,
                name="figure",
                caption=f"{table.caption} Best of a row in bold.",
                rows=tuple(_with_intervals_below(row) for row in table.rows),
            ),
            swatches={titles[n]: Markup('style="background: {}"').format(color) for n, color in palette.items()},
            pictures=[replace(picture(n, f), caption=_caption(n)) for n, f in figures.items()],
            trees={**notes, "Files": sources, "Settings": summary.settings, "Versions": summary.versions},
        )
    )


def _caption(name: str) -> str:
    return next((text for beginning, text in CAPTIONS.items() if name.startswith(beginning)), "")


def _with_intervals_below(row: Row) -> Row:
    """The row with each interval on a line below its figure."""
    return replace(row, cells=tuple(cell._replace(text=cell.text.replace(" [", "\n[")) for cell in row.cells))
