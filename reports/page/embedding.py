"""Figures inside the page: each an image of its own, so that nothing in it can reach out or run."""

from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass

from matplotlib.figure import Figure

from fgbaseline.reports.figures import Written, encoded

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


def picture(name: str, figure: Figure | Written) -> Picture:
    """The figure as SVG, or as PNG where that would be too large."""
    svg = encoded(figure, "svg")
    form, content = ("svg+xml", svg) if len(svg) <= LARGEST_SVG else ("png", encoded(figure, "png"))
    if isinstance(figure, Written):
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
