"""All figures of a run, in the order in which the page shows them, and those of its folder for a paper."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from . import over_time, paths, residuals
from .drawing import Captioned, DrawOne, EncodedFigure, drawn, drawn_for_paper, encoded_in_background
from .panels import smoothed
from .run_data import RunData, of_run

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Run

OVER_TIME: tuple[Callable[[RunData], Figure | None], ...] = (
    over_time.divergence,
    over_time.error_to_truth,
    paths.height,
    residuals.reprojection_over_time,
    residuals.reprojection_distribution,
    over_time.nees,
    over_time.time_per_frame,
    residuals.held_out,
    over_time.consistency,
    residuals.reprojection_classes,
    residuals.image_regions,
    residuals.map_difference,
)
"""each gives None where the run has no data for it"""
PAPER_FIGURES: Captioned = {
    "paths": (paths.paths_overlaid, "Trajectories on {sequence} from above."),
    "landmarks": (
        lambda run, style: paths.path_with_landmarks(run, paths.estimator_with_landmarks(run), style),
        "Trajectory and landmarks of {mapped} on {sequence} from above.",
    ),
    "divergence": (
        over_time.divergence,
        "Position and rotation divergence from the reference, {reference} ({trust}), on {sequence}, without alignment.",
    ),
    "error_to_truth": (over_time.error_to_truth, "Error to ground truth on {sequence}, without alignment."),
    "reprojection": (
        residuals.reprojection_over_time,
        "Median reprojection error of each frame of {sequence} (norm of the four pixel differences){smoothed}.",
    ),
    "consistency": (
        over_time.consistency,
        "Consistency on {sequence}, with the 95 % chi-square band of a consistent estimator; "
        "sigma ratios of the position are to {reference}{smoothed_nis}.",
    ),
    "held_out": (residuals.held_out, "Median held-out error on {sequence}, with 95 % intervals."),
    "map_difference": (
        residuals.map_difference,
        "Median distance of landmarks from those of {reference}, in the camera frame, by depth.",
    ),
    "time_per_frame": (over_time.time_per_frame, "Time per frame on {sequence}{smoothed}."),
}


def figure_functions(run: RunData) -> dict[str, DrawOne]:
    """Figures of a run by name, as `DIR/figures` and the page have them; none where no estimator answered.

    `paths_overlaid`, `paths_side_by_side`, `path_NAME` for each estimator that answered, then those over time that
    have something to show: `error_to_truth` and `nees` need truth, the reprojections need observations. Last the
    `three_sigma_NAME` of each that has covariances, where there is truth, and its `velocity_and_biases_NAME` where it
    has them.
    """
    if not run.names:
        return {}
    every = paths.paths_overlaid, paths.paths_side_by_side
    figures: dict[str, DrawOne] = {one.__name__: partial(one, run) for one in every}
    figures |= {f"path_{name}": partial(paths.path_with_landmarks, run, name) for name in run.names}
    figures |= {one.__name__: partial(one, run) for one in OVER_TIME}
    for r in run.answered:
        error, covariance, look = r.evidence.error, r.estimate.covariance, run.line()(r.name)
        figures[f"three_sigma_{r.name}"] = partial(over_time.three_sigma, r.name, run.t, error, covariance, look)
        figures[f"velocity_and_biases_{r.name}"] = partial(over_time.velocity_and_biases, run, r.name)
    return figures


def draw(run: "Run") -> dict[str, Figure]:
    """Figures of a run by name, those of `figure_functions` that have something to show."""
    return drawn(figure_functions(of_run(run)))


def draw_for_paper(run: RunData) -> dict[str, tuple[Figure, str]]:
    """Figures of a run for a paper in two columns: name -> figure and caption."""
    remark = smoothed(len(run.t))
    words = {
        "smoothed": remark and f", {remark}",
        "smoothed_nis": remark and f"; NIS: {remark}",
        "sequence": run.sequence,
        "reference": str(run.reference),
        "trust": run.trust,
        "mapped": paths.estimator_with_landmarks(run) or "",
    }
    return drawn_for_paper(run, PAPER_FIGURES, words)


def drawn_in_background(run: "Run", processes: int) -> AbstractContextManager[Callable[[], dict[str, EncodedFigure]]]:
    """Begins to draw, in other processes; what it gives waits for what `draw` draws, by name, written as PNG and SVG.

    The figures over time, which take longest, are the last and come first.
    """
    return encoded_in_background(figure_functions(of_run(run)), processes)
