"""Whether covariances tell the truth, and whether the estimators keep up with the camera."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from scipy.special import gammaincinv

from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Run

from .frames import fit_log, seconds, time_axis
from .lettering import plain
from .style import head, line, sheet

DEGREES_OF_FREEDOM = 6
NEES_BOUNDS = tuple(2.0 * float(gammaincinv(DEGREES_OF_FREEDOM / 2, p)) for p in (0.025, 0.975))
"""between which a pose's NEES lies in 95 % of the frames, for a filter that knows its errors: chi-square quantiles"""


def nees(run: Run) -> Figure | None:
    """The normalised estimation error squared of each pose; None without truth or covariances."""
    values = {r.name: r.nees for r in run.answered if r.nees is not None and np.isfinite(r.nees).any()}
    if not values:
        return None
    figure, axes = sheet(3.8)
    t = seconds(run)
    handles = []
    for name, series in values.items():
        handles += axes[0].plot(t, series, **{**line(run, run.results[name]), "linewidth": 1.1})
    fit_log(axes[0], values)
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(min(low, 0.7 * NEES_BOUNDS[0]), max(high, 1.4 * NEES_BOUNDS[1]))
    band = axes[0].axhspan(*NEES_BOUNDS, color="#d7e8d9", zorder=1, linewidth=0, label="95 % bounds (6 dof)")
    axes[0].axhline(DEGREES_OF_FREEDOM, color="#6b9a72", linewidth=0.9, zorder=1.5)
    axes[0].set_ylabel("NEES (above: overconfident)")
    time_axis(run, axes)
    head(figure, "NEES of each pose: its true error against the error it claims", [*handles, band])
    return figure


def time_per_frame(run: Run) -> Figure | None:
    """How long each frame took, beside the interval between frames; None where no estimator tells."""
    times = {r.name: 1e3 * r.estimate.seconds for r in run.answered if r.estimate.seconds.any()}
    times = {name: ms for name, ms in times.items() if len(ms) == run.problem.n_frames}
    if not times:
        return None
    runs = _runs(times)
    figure, axes = sheet(3.4)
    t = seconds(run)
    handles = []
    for names in runs:
        style = {**line(run, run.results[names[0]]), "linewidth": 0.9, "label": " and ".join(map(plain, names))}
        handles += axes[0].plot(t, times[names[0]], **style)
    interval = 1e3 * float(np.median(run.problem.sequence.dt))
    fit_log(axes[0], {**times, "": np.array([interval])})
    real_time = axes[0].axhline(
        interval, color="#888888", linewidth=1.0, linestyle=":", label=f"interval between frames ({interval:.3g} ms)"
    )
    axes[0].set_ylabel("time, ms")
    time_axis(run, axes)
    head(figure, "Time per frame", [*handles, real_time])
    return figure


def _runs(times: Mapping[str, FloatArray]) -> list[list[str]]:
    """The names that share their times, one run having given both answers."""
    runs: list[list[str]] = []
    for name, ms in times.items():
        same = next((names for names in runs if np.array_equal(times[names[0]], ms)), None)
        if same is None:
            runs.append([name])
        else:
            same.append(name)
    return runs
