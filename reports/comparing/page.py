"""The page of a comparison: one file that opens offline."""

from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from itertools import groupby

from markupsafe import Markup
from matplotlib.figure import Figure

from ..figures.palette import colours_of
from ..page.embedding import picture
from ..page.rendering import environment
from .comparison import Comparison
from .summary import summarise
from .tables import text_table

CAPTIONS: Mapping[str, str] = {
    "paths": "Aligned as said above, seen along the direction that points up.",
    "errors": "Of each pair of poses, along the reference's direction of travel, to its left and up.",
    "growth": "The same distance over the length of the path; a heading is seen from above, to the left positive.",
    "relative": "Boxes hold the middle half, whiskers 5 to 95 %, the line is the median. No alignment and no early "
    "mistake can hide in these.",
    "segments": "Mean over all segments of a length, per metre.",
    "map": "Landmarks of the same number. In the world the drift of the paths is in it; as the "
    "cameras see them it is not.",
    "three_sigma": "The error of each pose in its own body frame and the band that its covariances claim; both since "
    "the first pose where an alignment was asked for and the covariances grow from there.",
    "reprojection": "Solid with landmarks triangulated along each path in the same way, dotted with those that came "
    "with it.",
}


def _caption(name: str) -> str:
    return next((text for beginning, text in CAPTIONS.items() if name.startswith(beginning)), "")


def render(comparison: Comparison, figures: Mapping[str, Figure]) -> str:
    """`report.html`. All text that comes from files is escaped."""
    names, lines = text_table(comparison)
    trust = comparison.reference.trust
    return (
        environment()
        .get_template("compare.html")
        .render(
            css=Markup(files("fgbaseline.reports.page").joinpath("report.css").read_text(encoding="utf-8")),
            comparison=comparison,
            summary=summarise(comparison).model_dump(mode="json", by_alias=True),
            trust=None if trust is None else trust.verdict.name.lower(),
            names=names,
            groups=[(group, list(same)) for group, same in groupby(lines, key=lambda line: line.group)],
            colours=colours_of([comparison.reference.name, *comparison.results], comparison.reference.name),
            pictures=[replace(picture(n, f), caption=_caption(n)) for n, f in figures.items()],
        )
    )
