"""Writer of problems as npz, CSV and JSON, with the same numbers in full precision."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import StereoCamera

from ..formats.files.atomic_write import atomic_write
from ..formats.files.npz_member import write_member
from ..problem import Excluded, Problem
from . import layout
from .inertial import inertial_arrays, inertial_scalars


def write_problem(problem: Problem, folder: Path) -> None:
    """Writes a problem into an existing, empty folder; `read_problem` restores it exactly, without ground truth.

    Ground truth is not exported, because estimators must not use it. Raises InputError when a file cannot be written.
    """
    with atomic_write(folder / layout.ARRAYS) as file, zipfile.ZipFile(file, "w") as archive:
        for key, array in arrays(problem).items():
            form = "<i8" if array.dtype.kind in "iu" else "<f8"
            write_member(archive, key, array.shape, [array], form)
    text = json.dumps(scalars(problem), indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    with atomic_write(folder / layout.SCALARS) as file:
        file.write(text.encode("utf-8"))
    _tables(problem, folder)


def arrays(problem: Problem) -> dict[str, NDArray[Any]]:
    """Arrays of a problem: integers as int64, others as float64, missing values as NaN."""
    sequence = problem.sequence
    camera, o, prior = sequence.camera, sequence.observations, problem.landmark_prior
    numbers: dict[str, NDArray[Any]] = {
        "t": sequence.t,
        "linear_velocity": sequence.linear_velocity,
        "angular_velocity": sequence.angular_velocity,
        "K": camera.K,
        **({"b": np.array(camera.baseline)} if isinstance(camera, StereoCamera) else {}),
        "imu_T_cam": sequence.imu_T_cam,
        "up": sequence.up,
        "increment": problem.increment,
        "increment_covariance": problem.increment_covariance,
        "initial_pose": problem.initial_pose,
        "initial_covariance": problem.initial_covariance,
        "pixel_variance": np.array(problem.pixel_variance),
        "mapping_pixel_variance": np.array(_or_nan(problem.mapping_pixel_variance)),
        "pixel_inflation": np.array(problem.pixel_inflation),
        "huber_threshold": np.array(np.nan if problem.kernel is None else problem.kernel.threshold),
        "frame": o.frame,
        "landmark": o.landmark,
        "pixel": o.pixel,
        "excluded": problem.excluded,
        "n_landmarks": np.array(sequence.n_landmarks),
        "features": problem.features,
        **inertial_arrays(problem),
    }
    if prior is not None:
        numbers |= {"landmark_prior_mean": prior.mean, "landmark_prior_covariance": prior.covariance}
    return numbers


def scalars(problem: Problem) -> dict[str, Any]:
    """Scalars and texts, and for readers of the CSV files the small arrays."""
    sequence, prior = problem.sequence, problem.landmark_prior
    camera, baseline = sequence.camera, getattr(sequence.camera, "baseline", None)
    return {
        "schema": layout.SCHEMA,
        "sequence": {
            "name": sequence.name,
            "form": sequence.form,
            "source": sequence.source,
            "frames": sequence.n_frames,
            "landmarks": sequence.n_landmarks,
            "observations": len(sequence.observations),
            "remarks": list(sequence.remarks),
        },
        "preset": problem.preset,
        "diagnosed": problem.diagnosed,
        "reading": problem.landmark_mode.value,
        "remarks": [*problem.remarks, *problem.repairs],
        "camera": {"fu": camera.fu, "fv": camera.fv, "cu": camera.cu, "cv": camera.cv, "baseline": baseline},
        "imu_T_cam": sequence.imu_T_cam.tolist(),
        "up": sequence.up.tolist(),
        "initial_pose": problem.initial_pose.tolist(),
        "initial_covariance": problem.initial_covariance.tolist(),
        "pixel_variance": problem.pixel_variance,
        "mapping_pixel_variance": problem.mapping_pixel_variance,
        "pixel_inflation": problem.pixel_inflation,
        "huber_threshold": None if problem.kernel is None else problem.kernel.threshold,
        "landmark_prior_covariance": None if prior is None else prior.covariance.tolist(),
        "excluded": {reason.name.lower(): reason.value for reason in Excluded},
        **inertial_scalars(problem),
    }


def _tables(problem: Problem, folder: Path) -> None:
    sequence, o, prior = problem.sequence, problem.sequence.observations, problem.landmark_prior
    frames = [np.arange(sequence.n_frames), sequence.t]
    taking_part = problem.observations().counts(sequence.n_landmarks)[problem.features]
    mean = np.full((len(problem.features), 3), np.nan) if prior is None else prior.mean
    for name, titles, columns in (
        *_motion_tables(problem, frames),
        (layout.OBSERVATIONS, layout.OBSERVATION_COLUMNS, [o.frame, o.landmark, *o.pixel.T, problem.excluded]),
        (layout.LANDMARKS, layout.LANDMARK_COLUMNS, [problem.features, taking_part, *mean.T]),
    ):
        _table(folder / name, titles, columns)


def _motion_tables(
    problem: Problem, frames: list[NDArray[Any]]
) -> list[tuple[str, tuple[str, ...], list[NDArray[Any]]]]:
    """Tables of frames and increments, or of frames and raw inertial samples."""
    sequence, imu, steps = problem.sequence, problem.sequence.imu, len(problem.increment)
    if imu is not None:
        samples = [imu.t, *imu.angular_velocity.T, *imu.specific_force.T]
        return [(layout.FRAMES, layout.FRAME_COLUMNS[:2], frames), (layout.SAMPLES, layout.SAMPLE_COLUMNS, samples)]
    velocities = [*sequence.linear_velocity.T, *sequence.angular_velocity.T]
    covariance = np.asarray(problem.increment_covariance).reshape(steps, 36)
    increments = [np.arange(steps), sequence.dt, *problem.increment.T, *covariance.T]
    return [
        (layout.FRAMES, layout.FRAME_COLUMNS, [*frames, *velocities]),
        (layout.INCREMENTS, layout.INCREMENT_COLUMNS, increments),
    ]


def _table(path: Path, titles: tuple[str, ...], columns: list[NDArray[Any]]) -> None:
    """CSV of columns (n,): numbers in full precision, empty cells for missing values."""
    cells = [map(_cell, column.tolist()) for column in columns]
    lines = [",".join(titles), *(",".join(row) for row in zip(*cells, strict=True)), ""]
    with atomic_write(path) as file:
        file.write("\n".join(lines).encode("ascii"))


def _cell(value: float) -> str:
    return "" if value != value else repr(value)


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value
