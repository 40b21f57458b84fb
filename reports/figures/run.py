"""All figures of a run, in the order in which the page shows them, and those of its folder for a paper."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from .drawing import encoded_in_background
from .evidence import consistency, held_out, map_difference, nees, three_sigma, velocity_and_biases
from .layout import lay_out
from .over_time import divergence, error_to_truth, height, time_per_frame
from .panels import smoothed
from .paths import estimator_with_landmarks, path_with_landmarks, paths_overlaid, paths_side_by_side
from .reprojection import image_regions, reprojection_classes, reprojection_distribution, reprojection_over_time
from .run_data import RunData, of_run
from .saving import EncodedFigure
from .style import PAPER, in_style

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Run

OVER_TIME: tuple[Callable[[RunData], Figure | None], ...] = (
    divergence,
    error_to_truth,
    height,
    reprojection_over_time,
    reprojection_distribution,
    nees,
    time_per_frame,
    held_out,
    consistency,
    reprojection_classes,
    image_regions,
    map_difference,
)
"""each gives None where the run has no data for it"""
PAPER_FIGURES: Mapping[str, tuple[Callable[[RunData], Figure | None], str]] = {
    "paths": (partial(paths_overlaid, style=PAPER), "Trajectories on {sequence} from above."),
    "landmarks": (
        lambda run: path_with_landmarks(run, estimator_with_landmarks(run), PAPER),
        "Trajectory and landmarks of {mapped} on {sequence} from above.",
    ),
    "divergence": (
        partial(divergence, style=PAPER),
        "Position and rotation divergence from the reference, {reference} ({trust}), on {sequence}, without alignment.",
    ),
    "error_to_truth": (partial(error_to_truth, style=PAPER), "Error to ground truth on {sequence}, without alignment."),
    "reprojection": (
        partial(reprojection_over_time, style=PAPER),
        "Median reprojection error of each frame of {sequence} (norm of the four pixel differences){smoothed}.",
    ),
    "consistency": (
        partial(consistency, style=PAPER),
        "Consistency on {sequence}, with the 95 % chi-square band of a consistent estimator; "
        "sigma ratios of the position are to {reference}{smoothed_nis}.",
    ),
    "held_out": (
        partial(held_out, style=PAPER),
        "Median held-out error on {sequence}, with 95 % intervals.",
    ),
    "map_difference": (
        partial(map_difference, style=PAPER),
        "Median distance of landmarks from those of {reference}, in the camera frame, by depth.",
    ),
    "time_per_frame": (partial(time_per_frame, style=PAPER), "Time per frame on {sequence}{smoothed}."),
}
"""name -> figure, which may be None, and caption"""


def draw(run: "Run") -> dict[str, Figure]:
    """Figures of a run by name, as `DIR/figures` and the page have them; none where no estimator answered.

    `paths_overlaid`, `paths_side_by_side`, `path_NAME` for each estimator that answered, then those over time that
    have something to show: `error_to_truth` and `nees` need truth, the reprojections need observations. Last the
    `three_sigma_NAME` of each that has covariances, where there is truth, and its `velocity_and_biases_NAME` where it
    has them.
    """
    with in_style():
        drawn = {name: draw_one() for name, draw_one in figure_functions(of_run(run)).items()}
        figures = {name: figure for name, figure in drawn.items() if figure is not None}
        for figure in figures.values():
            lay_out(figure)
    return figures


def figure_functions(run: RunData) -> dict[str, Callable[[], Figure | None]]:
    """Functions that draw each of these figures, within `in_style()` and without layout; each may answer None."""
    if not run.names:
        return {}
    overlaid: dict[str, Callable[[], Figure | None]] = {
        "paths_overlaid": partial(paths_overlaid, run),
        "paths_side_by_side": partial(paths_side_by_side, run),
    }
    paths = {f"path_{name}": partial(path_with_landmarks, run, name) for name in run.names}
    over_time = {draw_one.__name__: partial(draw_one, run) for draw_one in OVER_TIME}
    bands: dict[str, Callable[[], Figure | None]] = {}
    for name in run.names:
        bands |= {f"three_sigma_{name}": partial(three_sigma, run, name)}
        bands |= {f"velocity_and_biases_{name}": partial(velocity_and_biases, run, name)}
    return {**overlaid, **paths, **over_time, **bands}


def draw_for_paper(run: RunData) -> dict[str, tuple[Figure, str]]:
    """Figures of a run for a paper in two columns: name -> figure and caption."""
    remark = smoothed(len(run.t))
    words = {
        "smoothed": remark and f", {remark}",
        "smoothed_nis": remark and f"; NIS: {remark}",
        "sequence": run.sequence,
        "reference": run.reference,
        "trust": run.trust,
        "mapped": estimator_with_landmarks(run) or "",
    }
    drawn = {}
    with in_style(PAPER):
        for name, (draw_one, caption) in PAPER_FIGURES.items():
            figure = draw_one(run)
            if figure is not None:
                lay_out(figure)
                drawn[name] = (figure, caption.format(**words))
    return drawn


@contextmanager
def drawn_in_background(run: "Run", processes: int) -> Iterator[Callable[[], dict[str, EncodedFigure]]]:
    """Begins to draw, in other processes; what it gives waits for what `draw` draws, by name, written as PNG and SVG.

    The bytes are the same however many processes share the work. The figures over time, which take longest, are the
    last and come first.
    """
    with encoded_in_background(figure_functions(of_run(run)), processes) as drawn:
        yield drawn


def draw_and_write(run: "Run", processes: int = 1) -> dict[str, EncodedFigure]:
    """Figures as `drawn_in_background` gives them, with nothing else to do meanwhile."""
    with drawn_in_background(run, processes) as drawn:
        return drawn()
