"""Trajectories as a caller gives them, files, arrays, estimates or truth, as the sources that a comparison resolves."""

import os
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fgbaseline.compare.trajectory_comparison.conventions import Source
from fgbaseline.data import Estimate, Landmarks, Status, Trajectory, Truth
from fgbaseline.data.formats import ParsedTrajectory, TrajectoryFormat
from fgbaseline.data.formats.files.file_errors import FilePath
from fgbaseline.data.formats.trajectories.format_detection import OpenedTrajectory, open_named, open_trajectory
from fgbaseline.data.formats.trajectories.reader import parsed_file
from fgbaseline.geometry import InputError

Array: TypeAlias = NDArray[Any]
TrajectoryLike: TypeAlias = FilePath | Trajectory | Estimate | Truth | Array | tuple[Array, Array]
"""a file (`[NAME=]FILE`: TUM, KITTI, EuRoC, npz); poses (T, 4, 4), an Estimate or a Truth, by frame; or stamps (n,), s,
with poses (n, 4, 4) or positions (n, 3)"""
ARRAYS = (np.ndarray, tuple)
"""types of trajectories without a name"""
ONE = (str, os.PathLike, Trajectory, ParsedTrajectory, Estimate, Truth, np.ndarray)
"""types of a single trajectory, besides a tuple of stamps and poses"""


def by_name(given: TrajectoryLike | Iterable[TrajectoryLike] | Mapping[str, TrajectoryLike]) -> list[tuple[str, Any]]:
    """Name and trajectory of each one that is given; the name is empty where it has its own, "estimate" of arrays."""
    if isinstance(given, Mapping):
        return [(str(name), each) for name, each in given.items()]
    every = [given] if isinstance(given, ONE) or _is_stamped(given) else given
    return [("estimate" if isinstance(each, ARRAYS) else "", each) for each in every]


def opened(
    given: TrajectoryLike | Source | OpenedTrajectory, form: TrajectoryFormat | None = None, name: str = ""
) -> Source:
    """Trajectory by a name, by default its own, as far as it is known without the others. Raises InputError."""
    if isinstance(given, str | os.PathLike):
        return parsed_file(open_trajectory(given, form, name) if name else open_named(given, form))
    if isinstance(given, OpenedTrajectory):
        return parsed_file(given)
    if isinstance(given, ParsedTrajectory):
        return given
    if isinstance(given, Trajectory):
        return _renamed(given, name)
    if isinstance(given, Estimate):
        return _of_estimate(given, name or given.name)
    if isinstance(given, Truth):
        return _of_frames(given.world_T_imu, name or "truth")
    if isinstance(given, np.ndarray):
        return _of_frames(given, name or "trajectory")
    if _is_stamped(given):
        return _of_stamps(*given, name or "trajectory")
    raise InputError(
        f"{name or 'trajectory'}: expected a file, a Trajectory, an Estimate, poses (T, 4, 4), or stamps (n,) with "
        f"poses (n, 4, 4), got {type(given).__name__}"
    )


def _is_stamped(given: object) -> bool:
    """Whether it is a tuple of stamps and poses, and not one of two trajectories."""
    return (
        isinstance(given, tuple) and len(given) == 2 and not isinstance(given[0], ONE[:-1]) and np.ndim(given[0]) == 1
    )


def _renamed(path: Trajectory, name: str) -> Trajectory:
    if not name:
        return path
    arrays = (path.t, path.world_T_body)
    return Trajectory(*arrays, name, path.source, path.line, path.stamped, path.oriented, proven=True)


def _of_stamps(t: Array, poses: Array, name: str) -> Trajectory:
    """Trajectory of stamps (n,), s, with poses (n, 4, 4) or positions (n, 3); all-NaN poses are left out."""
    t, poses = _numbers(t, name), _numbers(poses, name)
    positions_only = poses.ndim == 2 and poses.shape[1] == 3
    if t.ndim != 1 or not (positions_only or poses.shape == (len(t), 4, 4)) or len(poses) != len(t):
        raise InputError(
            f"{name}: expected stamps (n,) with poses (n, 4, 4) or positions (n, 3), got {t.shape} and {poses.shape}"
        )
    if positions_only:
        positions, poses = poses, np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, 3] = positions
        poses[np.isnan(positions).all(axis=1)] = np.nan
    known = ~np.isnan(poses).all(axis=(1, 2))
    return Trajectory(t[known], poses[known], name, oriented=not positions_only)


def _of_frames(poses: Array, name: str, covariance: Array | None = None, landmarks: Landmarks | None = None) -> Source:
    """Poses of frames (T, 4, 4); all-NaN poses are left out. Their stamps are those of a problem, if there is one."""
    poses = _numbers(poses, name)
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise InputError(f"{name}: expected poses (T, 4, 4), one for each frame, got {poses.shape}")
    frame = np.flatnonzero(~np.isnan(poses).all(axis=(1, 2)))
    return ParsedTrajectory(
        name=name,
        source=name,
        position=poses[frame, :3, 3],
        rotation=poses[frame, :3, :3],
        frame=frame,
        covariance_numbers=None if covariance is None else covariance[frame],
        landmarks=landmarks,
    )


def _of_estimate(estimate: Estimate, name: str) -> Source:
    if estimate.status is Status.FAILED:
        raise InputError(f"{name}: the estimator failed, so there is no trajectory to compare: {estimate.reason}")
    landmarks = estimate.landmarks if len(estimate.landmarks) else None
    return _of_frames(estimate.world_T_imu, name, estimate.covariance, landmarks)


def _numbers(given: Array, name: str) -> NDArray[np.float64]:
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: expected an array of numbers ({error})") from error
