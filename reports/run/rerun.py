"""Recording of a run for the viewer Rerun; needs the extra `rerun`."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from fgbaseline.compare.estimate_comparison import Result, Run
from fgbaseline.geometry import FloatArray, InputError, so3

from ..figures.style import TRUTH, colors, on_dark


def require_rerun(file: Path) -> None:
    """Raises InputError where the package rerun is not installed, or the file cannot be written."""
    if find_spec("rerun") is None:
        raise InputError(f"rerun: {file} needs the package rerun; install it with pip install 'fgbaseline[rerun]'")
    if file.is_dir() or not file.absolute().parent.is_dir():
        raise InputError(f"rerun: {file} is not a file in an existing folder; choose another")


def write_rerun(run: Run, file: Path) -> None:
    """Writes `file` atomically: paths, cameras, landmarks, errors by frame, and observations in the left image."""
    require_rerun(file)
    rr: Any = import_module("rerun")
    recording = rr.RecordingStream("fgbaseline", recording_id=run.problem.sequence.name, send_properties=False)
    partial = file.with_name(f".{file.name}.partial")
    try:
        recording.save(partial)
        _world(rr, recording, run)
        for result in run.answered:
            _estimator(rr, recording, run, result)
        _observations(rr, recording, run)
        recording.flush()
        recording.disconnect()
        partial.replace(file)
    finally:
        partial.unlink(missing_ok=True)


def _world(rr: Any, recording: Any, run: Run) -> None:
    up = run.problem.sequence.up
    axis = int(np.argmax(np.abs(up)))
    name = f"RIGHT_HAND_{'XYZ'[axis]}_{'UP' if up[axis] > 0 else 'DOWN'}"
    recording.log("world", getattr(rr.ViewCoordinates, name), static=True)
    truth = run.problem.sequence.truth
    if truth is not None:
        recording.log("world/truth", _strip(rr, truth.world_T_imu[truth.known, :3, 3], rgb(TRUTH)), static=True)


def _estimator(rr: Any, recording: Any, run: Run, result: Result) -> None:
    """Logs path and map once; camera, errors, NEES and NIS per frame."""
    estimate, name = result.estimate, _safe(result.name)
    color = rgb(on_dark(colors(run.results, run.reference)[result.name]))
    poses = estimate.world_T_imu
    known = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
    recording.log(f"world/{name}/path", _strip(rr, poses[known, :3, 3], color), static=True)
    if len(estimate.landmarks):
        points = rr.Points3D(estimate.landmarks.position, radii=0.1, colors=color)
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
            recording.log(path, rr.SeriesLines(colors=color, names=result.name), static=True)
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


def _observations(rr: Any, recording: Any, run: Run) -> None:
    """Logs the observations in the left image: those in the problem, and those that the mask excluded."""
    observations, T = run.problem.sequence.observations, run.problem.n_frames
    for name, chosen, color in (
        ("in_the_problem", run.problem.mask, "#56B4E9"),
        ("excluded", ~run.problem.mask, "#D55E00"),
    ):
        counts = np.bincount(observations.frame[chosen], minlength=T)
        if counts.any():
            columns = rr.Points2D.columns(positions=observations.pixel[chosen][:, :2]).partition(counts)
            path = f"left_image/{name}"
            recording.log(path, rr.Points2D.from_fields(colors=rgb(color), radii=2.0), static=True)
            recording.send_columns(path, _times(rr, run, np.arange(T)), columns)


def rgb(color: str) -> tuple[int, ...]:
    """Red, green and blue, 0 to 255, of `#RRGGBB`."""
    return tuple(bytes.fromhex(color[1:]))


def _times(rr: Any, run: Run, frames: Any) -> list[Any]:
    t = run.problem.sequence.t
    return [rr.TimeColumn("frame", sequence=frames), rr.TimeColumn("time", duration=t[frames] - t[0])]


def _strip(rr: Any, points: FloatArray, color: tuple[int, ...]) -> Any:
    return rr.LineStrips3D([points], radii=0.15, colors=color)


def _safe(name: str) -> str:
    """The name as one part of an entity path."""
    return "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
