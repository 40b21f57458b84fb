"""Data of the plots on a run's page: paths, landmarks, covariances, observations and series."""

from base64 import b64encode
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from fgbaseline.compare import chi_square_bounds, chi_square_quantile
from fgbaseline.compare.divergence_onset import divergence_onset, divergence_threshold, worst_second
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.compare.reference_trust import inflation_remark
from fgbaseline.data import Estimate, Excluded
from fgbaseline.data.top_view import TopView
from fgbaseline.data.tracking import Pictures
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.strapdown import STATE
from fgbaseline.reports.figures.panels import nees_bounds, nees_median
from fgbaseline.reports.formatting import counted, distance, listed
from fgbaseline.reports.tables.run_details import REASONS

from .plot_encoding import (
    TRUTH_LINE,
    Lines,
    chart,
    flags,
    floats,
    integers,
    median_by_frame,
    numbered,
    pixels,
    position_covariances,
    small_integers,
)


def charts(run: Run) -> list[dict[str, Any]]:
    """The charts in their order: `name`, `title`, `unit`, `hint`, `log`, `band`, `middle`, `group` and `lines`.

    `lines` has (T,) values by the number of the estimator in the run, as text; `bounds`, where there are any, how far
    the band around such a line reaches to either side.
    """
    drawn = [*_errors(run), *_velocity_and_biases(run), *_pixels(run), *_consistency(run), *_cost(run)]
    return [one for one in drawn if one is not None]


def _errors(run: Run) -> Iterable[dict[str, Any] | None]:
    away, group = f"from {run.reference}", "Divergence and errors"
    yield chart(group, "divergence", f"Divergence {away}, unaligned", "m", _column(run, "divergence", "position"))
    yield chart(group, "rotation", f"Rotation {away}, unaligned", "°", _column(run, "divergence", "rotation_deg"))
    yield chart(group, "along", f"Ahead of {run.reference}", "m", _column(run, "divergence", "along"))
    yield chart(group, "across", f"To the left of {run.reference}", "m", _column(run, "divergence", "across"))
    yield chart(group, "above", f"Above {run.reference}", "m", _column(run, "divergence", "up"))
    without = "difference from ground truth; all start at the true pose"
    yield chart(group, "error", "Unaligned position error", "m", _column(run, "truth", "position"), hint=without)
    yield chart(group, "error-rotation", "Unaligned rotation error", "°", _column(run, "truth", "rotation_deg"))
    view, truth = TopView.of(run.problem), run.problem.sequence.truth
    heights = {r.name: view.height(r.estimate.world_T_imu[:, :3, 3]) for r in run.answered}
    along = {} if truth is None else {TRUTH_LINE: view.height(truth.world_T_imu[:, :3, 3])}
    yield chart(group, "height", "Height above the start", "m", {**_numbered(run, heights), **along})


def _velocity_and_biases(run: Run) -> Iterable[dict[str, Any] | None]:
    """Charts of a run on raw inertial data; none without."""
    inertial = {r.name: r.inertial for r in run.answered if r.inertial is not None}
    group, truth = "Velocity and biases", run.problem.sequence.truth
    errors = {name: each.errors["velocity"].to_numpy() for name, each in inertial.items() if each.errors is not None}
    yield chart(group, "velocity", "Unaligned velocity error", "m/s", _numbered(run, errors))
    away = {
        name: each.divergence["velocity"].to_numpy() for name, each in inertial.items() if each.divergence is not None
    }
    yield chart(group, "velocity-divergence", f"Velocity from {run.reference}, unaligned", "m/s", _numbered(run, away))
    hint = "the estimates, and three of their sigmas to either side"
    for name, unit in (("gyroscope_bias", "rad/s"), ("accelerometer_bias", "m/s²")):
        true = None if truth is None else getattr(truth, name)
        for i, axis in enumerate("xyz"):
            values = _numbered(run, {key: each.values[f"{name}_{axis}"].to_numpy() for key, each in inertial.items()})
            sigmas = _numbered(
                run, {key: each.values[f"{name}_sigma_{axis}"].to_numpy() for key, each in inertial.items()}
            )
            bounds = {key: floats(3.0 * sigma) for key, sigma in sigmas.items() if np.isfinite(sigma).any()}
            lines = {**values, **({} if true is None else {TRUTH_LINE: true[:, i]})}
            title = f"{name.replace('_', ' ').capitalize()}, {axis}"
            key = f"{name.replace('_', '-')}-{axis}"
            yield chart(group, key, title, unit, lines, hint=hint, bounds=bounds, log=False)


def _pixels(run: Run) -> Iterable[dict[str, Any] | None]:
    medians = {
        r.name: median_by_frame(r.reprojection, run.problem.n_frames) for r in run.answered if len(r.reprojection)
    }
    title = "Median reprojection error by frame"
    hint = "over all observations of an estimator's landmarks, also those that the mask excludes"
    yield chart("Pixels", "reprojection", title, "px", _numbered(run, medians), log=True, smooth=True, hint=hint)


def _consistency(run: Run) -> Iterable[dict[str, Any] | None]:
    group = "Consistency"
    expected = "the band holds 95 % of the frames of a consistent estimator, the dotted line is their median"
    of_truth = {r.name: r.nees for r in run.answered if r.nees is not None}
    pose = {"log": True, "band": nees_bounds(), "middle": nees_median(), "hint": expected}
    yield chart(group, "nees", "NEES", "", _numbered(run, of_truth), **pose)
    beside = {r.name: r.evidence.difference.nees for r in run.answered if r.evidence.difference is not None}
    title = f"Reference NEES, to {run.reference}"
    left_out = {
        r.name: int(r.evidence.difference.left_out.sum()) for r in run.answered if r.evidence.difference is not None
    }
    none_in = listed(f"{counted(n, 'frame')} of {name}" for name, n in left_out.items() if n)
    why = f"; no value in {none_in}, where P − P_ref is not positive definite" if none_in else ""
    yield chart(group, "nees-reference", title, "", _numbered(run, beside), **pose | {"hint": expected + why})
    whole = {
        r.name: r.inertial.nees["state"].to_numpy() for r in run.answered if r.inertial and r.inertial.nees is not None
    }
    dof = float(STATE)
    bounds, middle = tuple(map(float, chi_square_bounds(dof))), float(chi_square_quantile(0.5, dof))
    state = {"log": True, "band": bounds, "middle": middle, "hint": expected}
    yield chart(group, "nees-state", "NEES of the state", "", _numbered(run, whole), **state)
    innovations = _innovations(run)
    if innovations is not None:
        nis = {r.name: r.evidence.nis_per_degree for r in run.answered}
        remark = inflation_remark(run.problem)
        hint = f"{expected}; {remark}, so that values far below the band are expected" if remark else expected
        title, look = "NIS per degree of freedom", {"log": True, "smooth": True, "hint": hint}
        yield chart(group, "nis", title, "", _numbered(run, nis), **look, **innovations)
    for part in ("position", "rotation"):
        tables = {r.name: r.evidence.sigma_ratio for r in run.answered}
        ratio = {name: table[part].to_numpy() for name, table in tables.items() if table is not None}
        title, hint = f"Sigma ratio of {part}, to {run.reference}", "expected above 1 for a filter"
        yield chart(group, f"sigma-{part}", title, "", _numbered(run, ratio), log=True, middle=1.0, hint=hint)


def _innovations(run: Run) -> dict[str, Any] | None:
    """Band and median for as many rows as the median frame with observations has; None where no filter has any."""
    seen = [r.estimate.innovations.degrees for r in run.answered if r.estimate.innovations is not None]
    rows = np.concatenate([degrees[degrees > 0] for degrees in seen]) if seen else np.empty(0)
    if len(rows) == 0:
        return None
    n = float(np.median(rows))
    band = tuple(float(limit) / n for limit in chi_square_bounds(n))
    return {"band": band, "middle": float(chi_square_quantile(0.5, n)) / n}


def _cost(run: Run) -> Iterable[dict[str, Any] | None]:
    T = run.problem.n_frames
    spent = {r.name: 1e3 * r.estimate.seconds for r in run.answered if len(r.estimate.seconds) == T}
    spent = {name: ms for name, ms in spent.items() if ms.any()}
    absent = [r.name for r in run.answered if r.name not in spent]
    without = f"; {listed(absent)} {'has' if len(absent) == 1 else 'have'} no time of each frame" if absent else ""
    hint = f"below the dotted line an estimator runs in real time{without}"
    interval = 1e3 * float(np.median(run.problem.sequence.dt))
    look = {"log": True, "smooth": True, "hint": hint}
    yield chart("Runtime", "time", "Time per frame", "ms", _numbered(run, spent), middle=interval, **look)


def _column(run: Run, table: str, column: str) -> Lines:
    """A column of each estimator's errors; the reference is not compared with itself."""
    read: Callable[[Result], Any] = {"divergence": lambda r: r.divergence, "truth": lambda r: r.truth}[table]
    compared = [r for r in run.answered if table == "truth" or r.name != run.reference]
    return _numbered(run, {r.name: read(r)[column].to_numpy() for r in compared if read(r) is not None})


def _numbered(run: Run, lines: Lines) -> Lines:
    return numbered(run.results, lines)


EDGE = 8.0
"""px between the outermost observations and the frame drawn around them"""


def page_data(run: Run, image_size: tuple[int, int] | None = None) -> dict[str, Any]:
    """Everything in the coordinates of the view from above: x ahead of the start, y to its left, z up, m.

    `image_size` is width and height, px, where they are known.
    """
    view, sequence = TopView.of(run.problem), run.problem.sequence
    axes = np.stack([view.ahead, view.left, view.up])
    truth = sequence.truth
    return {
        "frames": sequence.n_frames,
        "step": "frame",
        "stamped": True,
        "axes": ["ahead", "left", "up"],
        "t": floats(sequence.t - sequence.t[0]),
        "reference": run.reference,
        "estimators": [_estimator(run, r, axes) for r in run.results.values()],
        "truth": None if truth is None else floats(truth.world_T_imu[:, :3, 3] @ axes.T),
        "camera": _camera(run, image_size),
        "observations": _observations(run),
        "reasons": {str(int(Excluded[key.upper().replace(" ", "_")])): text for key, text in REASONS.items()},
        "charts": charts(run),
        "bookmarks": _bookmarks(run),
    }


def _estimator(run: Run, result: Result, axes: FloatArray) -> dict[str, Any]:
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
    return floats(position_covariances(axes @ estimate.world_T_imu[:, :3, :3], estimate.covariance))


def image_data(run: Run, images: Pictures) -> dict[str, list[str]]:
    """Images of the left and, of a pair, the right camera by the number of their frame, as data URIs."""
    return {
        str(k): [f"data:image/jpeg;base64,{b64encode(image).decode('ascii')}" for image in pair.images]
        for k, pair in images.by_frame(run.problem.sequence.t).items()
    }


def _camera(run: Run, size: tuple[int, int] | None) -> dict[str, Any]:
    """Intrinsics, and the size of the image, px; where it is not known, what the observations reach to."""
    camera, pixel = run.problem.sequence.camera, run.problem.sequence.observations.pixel
    reach = np.nan_to_num(pixel).max(axis=0) if len(pixel) else np.zeros(4)
    width, height = (max(c, float(reach[i::2].max()) + EDGE) for i, c in enumerate((camera.cu, camera.cv)))
    intrinsics = {name: getattr(camera, name, None) for name in ("fu", "fv", "cu", "cv", "baseline")}
    width, height = size or (round(width), round(height))
    return {**intrinsics, "width": width, "height": height}


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


def _bookmarks(run: Run) -> list[dict[str, Any]]:
    """Frames worth a look: first divergences, and the second with the most suspected errors of tracks."""
    bookmarks: list[dict[str, Any]] = []
    for result in run.compared:
        left = divergence_onset(run, result)
        if left is not None:
            text = f"{result.name} first {distance(divergence_threshold(result))} from {run.reference}"
            bookmarks.append({"frame": left.frame, "text": text})
    worst = worst_second(run.problem)
    if worst is not None:
        t = run.problem.sequence.t
        middle = int(np.argmin(np.abs(t - t[0] - worst.second - 0.5)))
        bookmarks.append({"frame": middle, "text": "most wrong or moving points"})
    return sorted(bookmarks, key=lambda bookmark: int(bookmark["frame"]))
