"""Templates of all pages, and figures as images inside them. A page without a script cannot run or load anything."""

import re
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, ClassVar

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.reports.figures.saving import EncodedFigure, encoded

from ..figures.style import dark_matrix
from ..formatting import counted, number, unbroken
from ..results.metric import INERTIAL_TERMS, TERMS
from ..results.provenance import creation

NO_SCRIPT = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""content security policy of a page without a script"""
LARGEST_SVG = 200_000
"""bytes, from which on the PNG takes its place"""

CAPTIONS: Mapping[str, str] = {
    "paths_overlaid": "Seen from above; all start at the same pose. Squares mark the ends.",
    "paths_side_by_side": "All panels have the same limits. Green dots: landmarks. Dashed: ground truth, where there "
    "is one; else the thin line is the reference.",
    "divergence": "Position and rotation difference from the reference, without alignment, and the position "
    "difference ahead of the reference, to its left and above it.",
    "error_to_truth": "Difference from ground truth in the same components, without alignment: all start at the true "
    "pose.",
    "height": "Along the up direction of the recording.",
    "reprojection_over_time": "Above, the median error over all observations of an estimator's landmarks, also those "
    "that the mask excludes. Below, all recorded observations of each frame, and which of them the mask excludes.",
    "reprojection_distribution": "Solid over all observations of an estimator's landmarks, also those that the mask "
    "excludes; dashed over those it used. Curves farther left are better.",
    "nees": "The band holds 95 % of the frames of a consistent estimator. Above it an estimator is overconfident, "
    "below it conservative.",
    "held_out": "Each half of a track is predicted from its other half along each trajectory. Trajectories whose "
    "intervals overlap can still be separated: the table has the paired difference from the best.",
    "consistency": "The bands of NEES and NIS hold 95 % of the frames of a consistent filter; the NEES is "
    "time-correlated. Where the pixel noise is inflated, a NIS far below the band is expected. The sigma ratio of a "
    "filter is expected above 1.",
    "reprojection_classes": "Flat lines mean that the error does not depend on distance or track age. The "
    "dotted curve is expected where the noise is as assumed; residuals are smaller to its left, as with inflated "
    "pixel noise, larger to its right.",
    "image_regions": "Errors that grow towards an edge can indicate distortion or a wrong rectification; near points "
    "at the bottom of the image and wrong matches raise them as well. All panels share "
    "one logarithmic scale.",
    "map_difference": "Landmarks are matched by the index of their track. Distances in the world include the drift of "
    "the trajectories; those in the camera frames do not.",
    "time_per_frame": "Below the dotted line an estimator runs in real time.",
}


@dataclass(frozen=True, slots=True)
class Picture:
    """A still figure ready for an `img`: a block of a page."""

    shape: ClassVar[str] = "figure"
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
    jinja.filters |= {
        "number": number,
        "counted": counted,
        "flattened": flattened,
        "anchor": anchor,
        "unbroken": unbroken,
    }
    jinja.globals |= {"dark_matrix": " ".join(f"{value:g}" for row in dark_matrix() for value in (*row[:3], 0, row[3]))}
    jinja.globals |= {"css": Markup(asset("report.css")), "policy": Markup(NO_SCRIPT), "glossary": TERMS}
    jinja.globals |= {"terms": {term: text for term, text in TERMS.items() if term not in INERTIAL_TERMS}}
    jinja.globals |= {"classes": {}, "creation": creation}
    return jinja


def anchor(text: str) -> str:
    """Identifier of an element under a title."""
    return re.sub(r"\W+", "-", text).strip("-").lower()


def flattened(tree: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    """Leaves of nested settings as (dotted name, text)."""
    leaves: list[tuple[str, str]] = []
    for key, value in tree.items():
        if isinstance(value, Mapping):
            leaves += flattened(value, f"{above}{key}.")
        elif isinstance(value, list | tuple):
            leaves.append((f"{above}{key}", ", ".join(map(str, value))))
        else:
            leaves.append((f"{above}{key}", "–" if value is None else str(value)))
    return leaves


def asset(name: str) -> str:
    """A template, style sheet or script of this folder."""
    return files("fgbaseline.reports.html").joinpath(name).read_text(encoding="utf-8")
