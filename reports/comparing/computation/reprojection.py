"""What estimates from anywhere say the pixels of a problem should have been."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.data import Estimate, Excluded, HeldOut, Landmarks, Problem, Trajectory
from fgbaseline.data.formats.ground_truth import match_stamps
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.triangulated import landmarks_along
from fgbaseline.geometry import FloatArray, se3

from .entry import Entry


@dataclass(frozen=True, eq=False, slots=True)
class Pixels:
    """Reprojection of one trajectory. For the columns see `compare.reprojection`; `used` is: is in the problem."""

    own: pd.DataFrame | None
    """with the landmarks that came with it; None without"""
    common: pd.DataFrame | None
    """the same over the observations that all have which came with landmarks"""
    along: pd.DataFrame | None
    """with landmarks triangulated along the trajectory, the same way for all; None where no frame has a pose"""
    frames: int
    """of the recording that have a pose"""
    notes: dict[str, str]
    """why something is missing"""


def paths_of(problem: Problem | None, entries: Sequence[Entry], offset: float) -> dict[str, FloatArray]:
    """By name the poses (T, 4, 4) of the problem's frames; nothing without a problem.

    Poses belong to the frames by their stamps, nearest in time within half an interval; `offset` (s) is added to those
    of all but the first entry, the reference.
    """
    if problem is None:
        return {}
    moved = [e.trajectory.later(offset) if offset and i else e.trajectory for i, e in enumerate(entries)]
    return {e.name: poses_of_frames(problem, path) for e, path in zip(entries, moved, strict=True)}


def pixels_of(problem: Problem | None, entries: Sequence[Entry], paths: Mapping[str, FloatArray]) -> dict[str, Pixels]:
    """By name; nothing without a problem. Each trajectory in its own world: no alignment comes into it."""
    if problem is None:
        return {}
    estimates = {e.name: _estimate(problem, e.name, paths[e.name], e.landmarks) for e in entries}
    own = {name: compare.reprojection(problem.sequence, e) for name, e in estimates.items() if len(e.landmarks)}
    common = _common(problem, own)
    return {name: _pixels(problem, estimate, own.get(name), common) for name, estimate in estimates.items()}


def held_out_of(problem: Problem | None, held: HeldOut | None, paths: Mapping[str, FloatArray]) -> pd.DataFrame | None:
    """The paths ranked by held-out tracks: see `compare.held_out_ranking`; None without any.

    Paths that no frame has a pose of are left out: there would be nothing in common.
    """
    known = {name: path for name, path in paths.items() if np.isfinite(path[:, 0, 0]).any()}
    if problem is None or held is None or not known:
        return None
    return compare.held_out_ranking(compare.held_out_errors(problem.sequence, held, known, problem.pixel_variance))


def poses_of_frames(problem: Problem, trajectory: Trajectory) -> FloatArray:
    """(T, 4, 4) the pose of each frame of the problem's sequence, NaN where the trajectory has none."""
    poses = np.full((problem.n_frames, 4, 4), np.nan)
    frames, chosen = match_stamps(problem.sequence.t, trajectory.t)
    poses[frames] = trajectory.world_T_body[chosen]
    return poses


def up_of_problem(problem: Problem, trajectory: Trajectory) -> FloatArray | None:
    """(3,) the problem's up in the world of a trajectory, which may be any: by its first pose that belongs to a frame.

    The problem knows up in the IMU's frame at frame 0; from there to that frame its increments lead. None where no
    pose belongs to a frame.
    """
    rotations = poses_of_frames(problem, trajectory)[:, :3, :3]
    known = np.flatnonzero(np.isfinite(rotations[:, 0, 0]))
    if len(known) == 0:
        return None
    k = int(known[0])
    since_start = se3.compose(se3.exp(problem.increment[:k]))[-1, :3, :3]
    return np.asarray(rotations[k] @ since_start.T @ problem.sequence.up)


def _estimate(problem: Problem, name: str, poses: FloatArray, landmarks: Landmarks | None) -> Estimate:
    return Estimate(name, poses, problem.mask, landmarks=Landmarks.none() if landmarks is None else landmarks)


def _common(problem: Problem, own: dict[str, pd.DataFrame]) -> BoolArray:
    """(n,) the problem's observations that every one of the tables has."""
    common = problem.mask
    for table in own.values():
        has = np.zeros(len(common), dtype=np.bool_)
        has[table["observation"]] = True
        common &= has
    return common


def _pixels(problem: Problem, estimate: Estimate, own: pd.DataFrame | None, common: BoolArray) -> Pixels:
    known = np.isfinite(estimate.world_T_imu[:, 0, 0])
    notes = {}
    if own is None:
        notes["reprojection"] = "no landmarks came with it"
    if not known.any():
        notes["reprojection_along"] = "no frame of the recording has a pose: its time stamps are others"
        return Pixels(own, None, None, 0, notes)
    o = problem.sequence.observations
    here = replace(problem, excluded=np.where(known[o.frame], problem.excluded, np.uint8(Excluded.GEOMETRY)))
    along = replace(estimate, used=here.mask, landmarks=landmarks_along(here, estimate.world_T_imu))
    table = compare.reprojection(problem.sequence, along)
    return Pixels(
        own=own,
        common=None if own is None else own[common[own["observation"]]],
        along=table[table["used"]],
        frames=int(known.sum()),
        notes=notes,
    )
