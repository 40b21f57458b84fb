"""A run as a recording for the viewer Rerun: for people who live in it. Needs the extra `rerun`."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.data import Truth
from fgbaseline.geometry import FloatArray, InputError, so3
from fgbaseline.reports.figures.style import TRUTH, colors, on_dark


def require_rerun(file: Path) -> None:
    """Raises InputError where the viewer's package is not installed, or the file cannot be written."""
    if find_spec("rerun") is None:
        raise InputError(f"rerun: {file} needs the viewer's package; install it with pip install 'fgbaseline[rerun]'")
    if file.is_dir() or not file.absolute().parent.is_dir():
        raise InputError(f"rerun: {file} is no file in an existing folder; choose another place")


def write_rerun(run: Run, file: Path) -> None:
    """Writes `file`, all or nothing: paths, cameras, landmarks, errors by frame and the left image's matches."""
    require_rerun(file)
    rr: Any = import_module("rerun")
    recording = rr.RecordingStream("fgbaseline", recording_id=run.problem.sequence.name, send_properties=False)
    beside = file.with_name(f".{file.name}.partial")
    try:
        recording.save(beside)
        _world(rr, recording, run)
        for result in run.answered:
            _estimator(rr, recording, run, result)
        _matches(rr, recording, run)
        recording.flush()
        recording.disconnect()
        beside.replace(file)
    finally:
        beside.unlink(missing_ok=True)


def _world(rr: Any, recording: Any, run: Run) -> None:
    up = np.abs(run.problem.sequence.up)
    axis = int(np.argmax(up))
    sign = run.problem.sequence.up[axis]
    name = f"RIGHT_HAND_{'XYZ'[axis]}_{'UP' if sign > 0 else 'DOWN'}"
    recording.log("world", getattr(rr.ViewCoordinates, name), static=True)
    truth = run.problem.sequence.truth
    if truth is not None:
        recording.log("world/truth", _strip(rr, _known(truth), rgb(TRUTH)), static=True)


def _estimator(rr: Any, recording: Any, run: Run, result: Result) -> None:
    """The whole path and map at once; camera, errors and reprojection frame by frame."""
    estimate, name = result.estimate, _safe(result.name)
    colour = rgb(on_dark(colors(run.results, run.reference)[result.name]))
    poses = estimate.world_T_imu
    known = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
    recording.log(f"world/{name}/path", _strip(rr, poses[known, :3, 3], colour), static=True)
    if len(estimate.landmarks):
        points = rr.Points3D(estimate.landmarks.position, radii=0.1, colors=colour)
        recording.log(f"world/{name}/landmarks", points, static=True)
    camera, image = run.problem.sequence.camera, run.problem.sequence.observations.pixel
    reach = image.max(axis=0) if len(image) else np.array([2 * camera.cu, 2 * camera.cv, 0.0, 0.0])
    pinhole = rr.Pinhole(
        focal_length=(camera.fu, camera.fv),
        principal_point=(camera.cu, camera.cv),
        width=float(reach[0]),
        height=float(reach[1]),
        image_plane_distance=2.0,
    )
    recording.log(f"world/{name}/camera", pinhole, static=True)
    cameras = poses[known] @ run.problem.sequence.imu_T_cam
    motion = rr.Transform3D.columns(translation=cameras[:, :3, 3], quaternion=so3.quaternion_xyzw(cameras[:, :3, :3]))
    recording.send_columns(f"world/{name}/camera", _times(rr, run, known), motion)
    for what, values in _series(result).items():
        there = np.flatnonzero(np.isfinite(values))
        if len(there):
            path = f"series/{what}/{name}"
            recording.log(path, rr.SeriesLines(colors=colour, names=result.name), static=True)
            recording.send_columns(path, _times(rr, run, there), rr.Scalars.columns(scalars=values[there]))


def _series(result: Result) -> dict[str, FloatArray]:
    series: dict[str, FloatArray] = {"nis": result.evidence.nis_per_degree}
    if result.divergence is not None:
        series["divergence"] = result.divergence["position"].to_numpy()
    if result.truth is not None:
        series["error"] = result.truth["position"].to_numpy()
    if result.nees is not None:
        series["nees"] = result.nees
    return series


def _matches(rr: Any, recording: Any, run: Run) -> None:
    """What was measured in the left image, in two groups: in the problem, and excluded from it."""
    observations, T = run.problem.sequence.observations, run.problem.n_frames
    for name, chosen, colour in (
        ("in_the_problem", run.problem.mask, "#56B4E9"),
        ("excluded", ~run.problem.mask, "#D55E00"),
    ):
        counts = np.bincount(observations.frame[chosen], minlength=T)
        if counts.any():
            columns = rr.Points2D.columns(positions=observations.pixel[chosen][:, :2]).partition(counts)
            path = f"left_image/{name}"
            recording.log(path, rr.Points2D.from_fields(colors=rgb(colour), radii=2.0), static=True)
            recording.send_columns(path, _times(rr, run, np.arange(T)), columns)


def rgb(colour: str) -> tuple[int, ...]:
    """Red, green and blue, 0 to 255, of `#RRGGBB`."""
    return tuple(bytes.fromhex(colour[1:]))


def _times(rr: Any, run: Run, frames: Any) -> list[Any]:
    t = run.problem.sequence.t
    return [rr.TimeColumn("frame", sequence=frames), rr.TimeColumn("time", duration=t[frames] - t[0])]


def _strip(rr: Any, points: FloatArray, colour: tuple[int, ...]) -> Any:
    return rr.LineStrips3D([points], radii=0.15, colors=colour)


def _known(truth: Truth) -> FloatArray:
    return truth.world_T_imu[truth.known, :3, 3]


def _safe(name: str) -> str:
    """A name as one part of an entity's path."""
    return "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
