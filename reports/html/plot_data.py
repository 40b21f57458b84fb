"""Data of the plots on a run's page: paths, landmarks, covariances, observations and series."""

from base64 import b64encode
from collections.abc import Iterable
from typing import Any

import numpy as np

from fgbaseline.compare.divergence_onset import divergence_onset, divergence_threshold, worst_second
from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.compare.reference_trust import inflation_remark
from fgbaseline.data import Excluded
from fgbaseline.data.top_view import TopView
from fgbaseline.data.tracking import Pictures
from fgbaseline.geometry.strapdown import STATE

from ..figures.panels import DEGREES_OF_FREEDOM
from ..figures.run_data import RunData, of_run
from ..formatting import counted, distance, listed
from ..tables.run_details import REASONS
from .plot_encoding import (
    TRUTH_LINE,
    Chart,
    chart,
    expected,
    flags,
    floats,
    grouped,
    integers,
    numbered,
    pixels,
    position_covariances,
)

ALL_OBSERVATIONS = "over all observations of an estimator's landmarks, including those that the mask excludes"
EDGE = 8.0
"""px between the outermost observations and the frame drawn around them"""


def charts(run: Run, data: RunData) -> list[Chart]:
    """The charts of a run in their order; those without lines are left out.

    Their lines have (T,) values by the number of the estimator in the run, as text.
    """
    reference, frames = run.reference, "frames of a consistent estimator"

    def of(name: str, title: str, unit: str, column: str, **look: Any) -> Chart | None:
        """Chart of a column of the series."""
        return chart(name, title, unit, numbered(run.results, data.column(column)), **look)

    heights = numbered(run.results, {name: path[:, 2] for name, path in data.paths.items()})
    if data.truth is not None:
        heights |= {TRUTH_LINE: data.truth[:, 2]}
    fixed = "pose" if run.problem.imu is None else "position and heading"
    unaligned = f"difference from ground truth; all start at its {fixed}"
    every = {"log": True, "smooth": True, "hint": ALL_OBSERVATIONS}
    pose, rows = expected(DEGREES_OF_FREEDOM, frames), data.nis_rows or 1.0
    ratio = {"log": True, "middle": 1.0, "hint": "expected of a consistent filter: at least 1 (dotted line)"}
    times, interval = numbered(run.results, data.milliseconds()), 1e3 * float(np.median(run.problem.sequence.dt))
    absent = [r.name for r in run.answered if r.name not in data.milliseconds()]
    without = f"; {listed(absent)} {'has' if len(absent) == 1 else 'have'} no time per frame" if absent else ""
    hint = f"below the dotted line an estimator runs in real time{without}"
    real_time = {"log": True, "smooth": True, "hint": hint}
    beside, innovations = dict(pose), expected(rows, frames, per=rows)
    beside["hint"] += _undefined(run)
    if remark := inflation_remark(run.problem):
        innovations["hint"] += f"; {remark}, so that values far below the band are expected"
    groups = {
        "Divergence and errors": [
            of("divergence", f"Divergence from {reference}, unaligned", "m", "divergence_position"),
            of("rotation", f"Rotation difference from {reference}, unaligned", "°", "divergence_rotation_deg"),
            of("along", f"Ahead of {reference}", "m", "divergence_along"),
            of("across", f"To the left of {reference}", "m", "divergence_across"),
            of("above", f"Above {reference}", "m", "divergence_up"),
            of("error", "Unaligned position error", "m", "truth_position", hint=unaligned),
            of("error-rotation", "Unaligned rotation error", "°", "truth_rotation_deg", hint=unaligned),
            chart("height", "Height above the start", "m", heights),
        ],
        "Velocity and biases": [
            of("velocity", "Unaligned velocity error", "m/s", "truth_velocity"),
            of("velocity-divergence", f"Velocity difference from {reference}, unaligned", "m/s", "divergence_velocity"),
            *_biases(run, data),
        ],
        "Pixels": [of("reprojection", "Median reprojection error by frame", "px", "reprojection_median", **every)],
        "Consistency": [
            of("nees", "NEES", "", "nees", **pose),
            of("nees-reference", f"Reference NEES against {reference}", "", "nees_reference", **beside),
            of("nees-state", "NEES of the state", "", "nees_state", **expected(float(STATE), frames)),
            of("nis", "NIS per degree of freedom", "", "nis_per_row", smooth=True, **innovations),
            of("sigma-position", f"Sigma ratio to {reference}, position", "", "sigma_ratio_position", **ratio),
            of("sigma-rotation", f"Sigma ratio to {reference}, rotation", "", "sigma_ratio_rotation", **ratio),
        ],
        "Runtime": [chart("time", "Time per frame", "ms", times, middle=interval, **real_time)],
    }
    return grouped(groups)


def _undefined(run: Run) -> str:
    """Clause on the frames of each estimator in which the reference NEES is not defined; empty without any."""
    differences = {r.name: r.evidence.difference for r in run.answered if r.evidence.difference is not None}
    counts = {name: int(difference.left_out.sum()) for name, difference in differences.items()}
    each = listed(f"{counted(n, 'frame')} of {name}" for name, n in counts.items() if n)
    return f"; no value in {each}, where P − P_ref is not positive definite" if each else ""


def _biases(run: Run, data: RunData) -> Iterable[Chart | None]:
    """Charts of the components; `bounds` is how far the band around a line reaches to either side."""
    truth, hint = run.problem.sequence.truth, "estimates with ±3-sigma bounds"
    for name, unit in (("gyroscope_bias", "rad/s"), ("accelerometer_bias", "m/s^2")):
        true = None if truth is None else getattr(truth, name)
        for i, axis in enumerate("xyz"):
            lines = numbered(run.results, data.column(f"{name}_{axis}"))
            if true is not None:
                lines |= {TRUTH_LINE: true[:, i]}
            sigmas = numbered(run.results, data.column(f"{name}_sigma_{axis}"))
            bounds = {key: floats(3.0 * sigma) for key, sigma in sigmas.items()}
            title, key = f"{name.replace('_', ' ').capitalize()}, {axis}", f"{name.replace('_', '-')}-{axis}"
            yield chart(key, title, unit, lines, hint=hint, bounds=bounds, log=False)


def page_data(run: Run, image_size: tuple[int, int] | None = None) -> dict[str, Any]:
    """Everything in the coordinates of the view from above: x ahead of the start, y to its left, z up, m.

    `image_size` is width and height, px, where they are known.
    """
    sequence, data = run.problem.sequence, of_run(run)
    return {
        "frames": sequence.n_frames,
        "step": "frame",
        "stamped": True,
        "axes": ["ahead", "left", "up"],
        "t": floats(data.t),
        "reference": run.reference,
        "estimators": [_estimator(run, data, r) for r in run.results.values()],
        "truth": None if data.truth is None else floats(data.truth),
        "camera": _camera(run, image_size),
        "observations": _observations(run),
        "reasons": {str(int(Excluded[key.upper().replace(" ", "_")])): text for key, text in REASONS.items()},
        "charts": charts(run, data),
        "bookmarks": _bookmarks(run),
    }


def _estimator(run: Run, data: RunData, result: Result) -> dict[str, Any]:
    """An estimator: path (T, 3), camera poses (T, 3, 4), position covariances (T, 6), landmarks, what it used."""
    estimate, name = result.estimate, result.name
    about: dict[str, Any] = {"name": name, "answered": result.answered}
    if not result.answered:
        return about
    view = TopView.of(run.problem)
    axes, poses, covariance = np.stack([view.ahead, view.left, view.up]), estimate.world_T_imu, estimate.covariance
    return about | {
        "path": floats(data.paths[name]),
        "cameras": floats(axes @ (poses @ run.problem.sequence.imu_T_cam)[:, :3, :]),
        "covariance": None if covariance is None else floats(position_covariances(axes @ poses[:, :3, :3], covariance)),
        "landmarks": integers(estimate.landmarks.index),
        "points": floats(data.landmarks.get(name, np.empty((0, 3)))),
        "used": flags(estimate.used) if estimate.used.any() else None,
    }


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
        "excluded": integers(run.problem.excluded, bits=8),
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
        bookmarks.append({"frame": middle, "text": "most excluded wrong matches or moving points"})
    return sorted(bookmarks, key=lambda bookmark: int(bookmark["frame"]))
