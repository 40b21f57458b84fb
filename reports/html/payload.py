"""What the page's plots are drawn from: paths, landmarks, covariances, observations and series of a run."""

from typing import Any

import numpy as np

from fgbaseline.data import Estimate, Excluded, Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Result, Run
from fgbaseline.reports.figures.panels import moving_sum
from fgbaseline.reports.figures.reprojection import WRONG
from fgbaseline.reports.figures.view import TopView

from .accuracy_verdict import compared
from .charts import charts
from .departure import departure, far
from .packing import flags, floats, integers, pixels, small_integers

REASONS = {
    Excluded.FEATURE_NOT_CHOSEN: "not among the features asked for",
    Excluded.DISPARITY: "disparity too small",
    Excluded.ROWS: "rows disagree",
    Excluded.PREDICTION: "contradicts its own track",
    Excluded.SHORT: "track too short to check",
    Excluded.GEOMETRY: "point not determined",
    Excluded.MOVING: "point moved",
    Excluded.COPIED: "copied from the frame before",
}
"""why an observation takes no part, as a few words beside a mark"""
EDGE = 8.0
"""px between the outermost observations and the frame drawn around them"""


def payload(run: Run) -> dict[str, Any]:
    """Everything in the coordinates of the view from above: x ahead of the start, y to its left, z up, m."""
    view, sequence = TopView.of(run.problem), run.problem.sequence
    axes = np.stack([view.ahead, view.left, view.up])
    truth = sequence.truth
    return {
        "frames": sequence.n_frames,
        "t": floats(sequence.t - sequence.t[0]),
        "reference": run.reference,
        "who": [_who(run, r, axes) for r in run.results.values()],
        "truth": None if truth is None else floats(truth.world_T_imu[:, :3, 3] @ axes.T),
        "camera": _camera(run),
        "observations": _observations(run),
        "reasons": {str(int(reason)): text for reason, text in REASONS.items()},
        "charts": charts(run),
        "jumps": _jumps(run),
    }


def _who(run: Run, result: Result, axes: FloatArray) -> dict[str, Any]:
    """An estimator: path (T, 3), camera poses (T, 3, 4), position covariances (T, 6), landmarks, what it used."""
    estimate = result.estimate
    about: dict[str, Any] = {"name": result.name, "answered": result.answered}
    if not result.answered:
        return about
    cameras = estimate.world_T_imu @ run.problem.sequence.imu_T_cam
    used = estimate.used
    with np.errstate(invalid="ignore"):  # a landmark at infinity
        points = estimate.landmarks.position @ axes.T
    return about | {
        "path": floats(estimate.world_T_imu[:, :3, 3] @ axes.T),
        "cameras": floats(axes @ cameras[:, :3, :]),
        "covariance": _position_covariance(estimate, axes),
        "landmarks": integers(estimate.landmarks.index),
        "points": floats(points),
        "used": flags(used) if used.any() else None,
    }


def _position_covariance(estimate: Estimate, axes: FloatArray) -> str | None:
    """(T, 6) m^2: xx, xy, xz, yy, yz, zz; the covariance is of the right perturbation, so the body's axes turn it."""
    if estimate.covariance is None:
        return None
    R = axes @ estimate.world_T_imu[:, :3, :3]
    P = R @ estimate.covariance[:, :3, :3] @ np.swapaxes(R, 1, 2)
    row, column = np.triu_indices(3)
    return floats(P[:, row, column])


def _camera(run: Run) -> dict[str, Any]:
    """Intrinsics, and the size of the image as far as it is known: what the observations reach to."""
    camera, pixel = run.problem.sequence.camera, run.problem.sequence.observations.pixel
    reach = pixel.max(axis=0) if len(pixel) else np.zeros(4)
    width, height = (max(c, float(reach[i::2].max()) + EDGE) for i, c in enumerate((camera.cu, camera.cv)))
    intrinsics = {name: float(getattr(camera, name)) for name in ("fu", "fv", "cu", "cv", "baseline")}
    return {**intrinsics, "width": round(width), "height": round(height)}


def _observations(run: Run) -> dict[str, Any] | None:
    observations = run.problem.sequence.observations
    if len(observations) == 0:
        return None
    pixel, parts = pixels(observations.pixel)
    starts = np.searchsorted(observations.frame, np.arange(run.problem.n_frames + 1))
    return {
        "starts": integers(starts),
        "landmark": integers(observations.landmark),
        "pixel": pixel,
        "parts": parts,
        "excluded": small_integers(run.problem.excluded),
    }


def _jumps(run: Run) -> list[dict[str, Any]]:
    """The frames that a person will want to see first."""
    jumps: list[dict[str, Any]] = []
    for result in compared(run):
        left = departure(run, result)
        if left is not None:
            text = f"{result.name} first {far(result):.3g} m from {run.reference}"
            jumps.append({"frame": left.frame, "text": text})
    worst = _most_excluded(run.problem)
    return jumps if worst is None else [*jumps, {"frame": worst, "text": "most matches found wrong"}]


def _most_excluded(problem: Problem) -> int | None:
    """The frame around which, for a second, the largest share of matches was found wrong; None where none was."""
    frame, T = problem.sequence.observations.frame, problem.n_frames
    wrong = np.bincount(frame[np.isin(problem.excluded, (*WRONG, Excluded.COPIED))], minlength=T)
    every = np.bincount(frame[problem.excluded != Excluded.FEATURE_NOT_CHOSEN], minlength=T)
    if not wrong.any():
        return None
    half = round(min(0.5 / float(np.median(problem.sequence.dt)), T))
    return int(np.argmax(moving_sum(wrong, 1 + 2 * half) / np.maximum(1, moving_sum(every, 1 + 2 * half))))
