"""What the page draws over time: one chart for each quantity that the run has, a line for each estimator."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from fgbaseline.compare import chi_square_bounds, reprojection_by
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Result, Run
from fgbaseline.reports.figures.panels import DEGREES_OF_FREEDOM, NEES_BOUNDS
from fgbaseline.reports.figures.view import TopView

from .packing import floats

TRUTH_LINE = "truth"
"""the key of the truth among the lines of a chart; no estimator has it, as theirs are numbers"""
OUTLIER = 30.0
"""times farther than every other line: then one line alone would flatten all others on a linear axis"""

Lines = Mapping[str, FloatArray]


def charts(run: Run) -> list[dict[str, Any]]:
    """The charts in their order: `name`, `title`, `unit`, `hint`, `log`, `band`, `middle`, `group` and `lines`.

    `lines` has (T,) values by the number of the estimator in the run, as text.
    """
    drawn = [*_errors(run), *_pixels(run), *_consistency(run), *_cost(run)]
    return [chart for chart in drawn if chart is not None]


def _errors(run: Run) -> Iterable[dict[str, Any] | None]:
    away, group = f"from {run.reference}", "Where the paths part"
    yield _chart(group, "divergence", f"Distance {away}", "m", _column(run, "divergence", "position"))
    yield _chart(group, "rotation", f"Angle {away}", "°", _column(run, "divergence", "rotation_deg"))
    yield _chart(group, "along", f"Ahead of {run.reference}", "m", _column(run, "divergence", "along"))
    yield _chart(group, "across", f"To the left of {run.reference}", "m", _column(run, "divergence", "across"))
    without = "without any alignment: all start at the true pose"
    yield _chart(group, "error", "Error to the truth", "m", _column(run, "truth", "position"), hint=without)
    yield _chart(group, "error-rotation", "Angle from the truth", "°", _column(run, "truth", "rotation_deg"))
    view, truth = TopView.of(run.problem), run.problem.sequence.truth
    heights = {r.name: view.height(r.estimate.world_T_imu[:, :3, 3]) for r in run.answered}
    along = {} if truth is None else {TRUTH_LINE: view.height(truth.world_T_imu[:, :3, 3])}
    yield _chart(group, "height", "Height above the start", "m", {**_numbered(run, heights), **along})


def _pixels(run: Run) -> Iterable[dict[str, Any] | None]:
    medians = {r.name: _by_frame(run, r) for r in run.answered if len(r.reprojection)}
    title = "Reprojection error, median of each frame"
    hint = "over all observations of the landmarks that an estimator has"
    yield _chart("Pixels", "reprojection", title, "px", _numbered(run, medians), log=True, hint=hint)


def _consistency(run: Run) -> Iterable[dict[str, Any] | None]:
    group, expected = "Consistency", "the band holds 95 % of the frames of who knows their errors"
    of_truth = {r.name: r.nees for r in run.answered if r.nees is not None}
    pose = {"log": True, "band": NEES_BOUNDS, "middle": float(DEGREES_OF_FREEDOM), "hint": expected}
    yield _chart(group, "nees", "NEES: true error against the error claimed", "", _numbered(run, of_truth), **pose)
    beside = {r.name: r.evidence.difference.nees for r in run.answered if r.evidence.difference is not None}
    title = f"NEES of the difference from {run.reference}"
    yield _chart(group, "nees-reference", title, "", _numbered(run, beside), **pose)
    band = _innovation_band(run)
    nis = {r.name: r.evidence.nis_per_degree for r in run.answered}
    innovations = "Innovations: NIS per row"
    yield _chart(group, "nis", innovations, "", _numbered(run, nis), log=True, band=band, middle=1.0, hint=expected)
    for part in ("position", "rotation"):
        tables = {r.name: r.evidence.sigma_ratio for r in run.answered}
        ratio = {name: table[part].to_numpy() for name, table in tables.items() if table is not None}
        title, hint = f"Sigma of {part} over that of {run.reference}", "a filter's should be above 1"
        yield _chart(group, f"sigma-{part}", title, "", _numbered(run, ratio), log=True, middle=1.0, hint=hint)


def _innovation_band(run: Run) -> tuple[float, ...] | None:
    """For as many rows as the median frame that sees anything has; None where nobody's filter sees anything."""
    seen = [r.estimate.innovations.degrees for r in run.answered if r.estimate.innovations is not None]
    rows = np.concatenate([degrees[degrees > 0] for degrees in seen]) if seen else np.empty(0)
    if len(rows) == 0:
        return None
    n = float(np.median(rows))
    return tuple(float(limit) / n for limit in chi_square_bounds(n))


def _cost(run: Run) -> Iterable[dict[str, Any] | None]:
    T = run.problem.n_frames
    spent = {r.name: 1e3 * r.estimate.seconds for r in run.answered if len(r.estimate.seconds) == T}
    spent = {name: ms for name, ms in spent.items() if ms.any()}
    interval = 1e3 * float(np.median(run.problem.sequence.dt))
    hint = "below the thin line an estimator keeps up with the camera"
    yield _chart("Cost", "time", "Time per frame", "ms", _numbered(run, spent), log=True, middle=interval, hint=hint)


def _chart(group: str, name: str, title: str, unit: str, lines: Lines, **more: Any) -> dict[str, Any] | None:
    """A chart; None where no line has a value."""
    known = {who: values for who, values in lines.items() if np.isfinite(values).any()}
    if not known:
        return None
    settings = {"log": _one_flattens_all(known.values()), "band": None, "middle": None, "hint": "", **more}
    packed = {who: floats(values) for who, values in known.items()}
    return {"group": group, "name": name, "title": title, "unit": unit, "lines": packed, **settings}


def _one_flattens_all(lines: Iterable[FloatArray]) -> bool:
    """Whether a logarithmic axis is needed to see more than one of lines that are nowhere negative."""
    series = [values[np.isfinite(values)] for values in lines]
    if any(values.min() < 0.0 for values in series):
        return False
    largest = sorted((float(values.max()) for values in series), reverse=True)
    return len(largest) > 1 and largest[0] > OUTLIER * largest[1] > 0.0


def _column(run: Run, table: str, column: str) -> Lines:
    """A column of each estimator's errors; the reference is not compared with itself."""
    read: Callable[[Result], Any] = {"divergence": lambda r: r.divergence, "truth": lambda r: r.truth}[table]
    compared = [r for r in run.answered if table == "truth" or r.name != run.reference]
    return _numbered(run, {r.name: read(r)[column].to_numpy() for r in compared if read(r) is not None})


def _by_frame(run: Run, result: Result) -> FloatArray:
    median = reprojection_by(result.reprojection, "frame")["median"]
    values: FloatArray = median.reindex(range(run.problem.n_frames)).to_numpy(dtype=np.float64)
    return values


def _numbered(run: Run, lines: Lines) -> Lines:
    number = {name: str(i) for i, name in enumerate(run.results)}
    return {number[name]: np.asarray(values, dtype=np.float64) for name, values in lines.items()}
