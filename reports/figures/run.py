"""All figures of a run, in the order in which the page shows them."""

from collections.abc import Callable
from functools import partial

from matplotlib.figure import Figure

from fgbaseline.reports.comparison import Run

from .beyond import held_out, map_difference
from .classes import reprojection_classes
from .consistency import consistency, three_sigma
from .errors import divergence, error_to_truth, height
from .health import nees, time_per_frame
from .layout import lay_out
from .paths import path_with_landmarks, paths_overlaid, paths_side_by_side
from .reprojections import reprojection_distribution, reprojection_over_time
from .style import in_style

OVER_TIME: tuple[Callable[[Run], Figure | None], ...] = (
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
    map_difference,
)
"""each answers None where the run has nothing for it to show"""


def draw(run: Run) -> dict[str, Figure]:
    """The figures of a run by name, as `DIR/figures` and the page have them; none where no estimator answered.

    `paths_overlaid`, `paths_side_by_side`, `path_NAME` for each estimator that answered, then those over time that
    have something to show: `error_to_truth` and `nees` need truth, the reprojections need observations. Last the
    `three_sigma_NAME` of each that has covariances, where there is truth.
    """
    with in_style():
        drawn = {name: draw_one() for name, draw_one in drawings(run).items()}
        figures = {name: figure for name, figure in drawn.items() if figure is not None}
        for figure in figures.values():
            lay_out(figure)
    return figures


def drawings(run: Run) -> dict[str, Callable[[], Figure | None]]:
    """What draws each of these figures, within `in_style()` and without layout; each may answer None."""
    answered = run.answered
    if not answered:
        return {}
    overlaid: dict[str, Callable[[], Figure | None]] = {
        "paths_overlaid": partial(paths_overlaid, run),
        "paths_side_by_side": partial(paths_side_by_side, run),
    }
    paths = {f"path_{result.name}": partial(path_with_landmarks, run, result) for result in answered}
    over_time = {draw_one.__name__: partial(draw_one, run) for draw_one in OVER_TIME}
    bands = {f"three_sigma_{result.name}": partial(three_sigma, run, result) for result in answered}
    return {**overlaid, **paths, **over_time, **bands}
