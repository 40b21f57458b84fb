"""The templates of all pages, and figures inside them, each an image of its own: nothing can reach out or run."""

import re
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.reports.figures import EncodedFigure, encoded

from ..formatting import counted, number
from ..results.metrics import TERMS

NO_SCRIPT = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""content security policy of a page without a script"""
LARGEST_SVG = 200_000
"""bytes, from which on the PNG takes its place"""

CAPTIONS: Mapping[str, str] = {
    "paths_overlaid": "Seen from above, along the direction that points up; all start from the same pose. "
    "Squares mark the ends.",
    "paths_side_by_side": "The same limits in each panel, landmarks in green. Where there is truth it is dashed, "
    "else the reference is drawn thin.",
    "divergence": "Distance and angle from the reference, and the distance split along its direction of travel, "
    "to its left and up.",
    "error_to_truth": "The same from the truth, without any alignment: all start at the true pose.",
    "height": "Along the direction that the recording's reader says is up.",
    "reprojection_over_time": "Above, the median error over all observations of the landmarks that an estimator has. "
    "Below, the matches of each frame; the mask excludes those that contradict their own track.",
    "reprojection_distribution": "Solid over all observations of the landmarks that an estimator has, dotted over "
    "those it used. Farther left is better.",
    "nees": "Inside the band a covariance tells the truth about the error; above it the estimator claims to know more "
    "than it does.",
    "held_out": "Each half of a track predicted from its other half, along each path. Intervals that overlap may still "
    "be told apart: the table has the difference from the best.",
    "consistency": "The band of the NEES and of the NIS holds 95 % of the single frames of a consistent filter; frames "
    "of the NEES are correlated. A filter's sigmas should be above the reference's.",
    "reprojection_classes": "Flat lines say that errors do not depend on where a point is or how long it was followed. "
    "Tracks below the dots have smaller errors than the noise assumed, above them larger ones.",
    "map_difference": "Landmarks matched by number. In the world the paths' drift is part of the distance, as seen by "
    "the cameras it is not.",
    "time_per_frame": "Below the dotted line an estimator keeps up with the camera.",
}


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure ready for an `img`."""

    name: str
    source: str
    """a data URI"""
    title: str
    caption: str
    width: int
    height: int


def picture(name: str, figure: Figure | EncodedFigure) -> Picture:
    """The figure as SVG, or as PNG where that would be too large."""
    svg = encoded(figure, "svg")
    form, content = ("svg+xml", svg) if len(svg) <= LARGEST_SVG else ("png", encoded(figure, "png"))
    if isinstance(figure, EncodedFigure):
        title, (width, height) = figure.title, figure.size
    else:
        title, (width, height) = str(figure.get_label()), figure.get_size_inches()
    return Picture(
        name=name,
        source=f"data:image/{form};base64,{b64encode(content).decode('ascii')}",
        title=title.replace(r"\$", "$"),
        caption=CAPTIONS.get(name, ""),
        width=round(100 * width),
        height=round(100 * height),
    )


def environment() -> Environment:
    """Templates beside this module; everything is escaped, and an unknown name is an error."""
    jinja = Environment(
        loader=FunctionLoader(asset), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    jinja.filters |= {"number": number, "counted": counted, "flat": flat, "anchor": anchor}
    jinja.globals |= {"css": Markup(asset("report.css")), "policy": Markup(NO_SCRIPT), "glossary": TERMS}
    return jinja


def anchor(text: str) -> str:
    """A title as the name of a place on the page."""
    return re.sub(r"\W+", "-", text).strip("-").lower()


def flat(tree: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    """The leaves of nested settings as (dotted name, text)."""
    leaves: list[tuple[str, str]] = []
    for key, value in tree.items():
        if isinstance(value, Mapping):
            leaves += flat(value, f"{above}{key}.")
        elif isinstance(value, list | tuple):
            leaves.append((f"{above}{key}", ", ".join(map(str, value))))
        else:
            leaves.append((f"{above}{key}", "–" if value is None else str(value)))
    return leaves


def asset(name: str) -> str:
    """A template, style sheet or script of this folder."""
    return files("fgbaseline.reports.html").joinpath(name).read_text(encoding="utf-8")
