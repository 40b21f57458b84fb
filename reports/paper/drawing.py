"""All figures of a run's folder, with their captions."""

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from ..figures.layout import lay_out
from .beyond import held_out, map_difference
from .folder import Drawn
from .over_time import consistency, divergence, error_to_truth, reprojection, time_per_frame
from .paths import landmarks, paths
from .style import in_style

FIGURES: Mapping[Callable[[Drawn], Figure | None], str] = {
    paths: "Paths on {sequence} from above.",
    landmarks: "Path and landmarks of {mapped} on {sequence} from above.",
    divergence: "Distance and angle from the reference, {reference} ({trust}), on {sequence}, without alignment.",
    error_to_truth: "Error to the truth on {sequence}, without alignment.",
    reprojection: "Median reprojection error of each frame of {sequence} (norm of the four pixel differences).",
    consistency: "Consistency on {sequence}: the band holds 95 % of the frames of an estimator that knows its errors; "
    "sigmas are those of the position over those of {reference}.",
    held_out: "Median error on tracks of {sequence} that no estimator saw, with 95 % intervals.",
    map_difference: "Median distance of landmarks from those of {reference}, as the cameras see them, by depth.",
    time_per_frame: "Time per frame on {sequence}.",
}
"""each answers None where the run has nothing for it to show"""


def draw(run: Drawn) -> dict[str, tuple[Figure, str]]:
    """Name -> figure and caption."""
    mapped = run.reference if run.reference in run.landmarks else next(iter(run.landmarks), "")
    words = {"sequence": run.sequence, "reference": run.reference, "trust": run.trust, "mapped": mapped}
    drawn = {}
    with in_style():
        for of, caption in FIGURES.items():
            figure = of(run)
            if figure is not None:
                lay_out(figure)
                drawn[of.__name__] = (figure, caption.format(**words))
    return drawn
