"""Metrics of trajectories from the observations of a recording: reprojection, held-out tracks, landmarks; up."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from fgbaseline import compare
from fgbaseline.compare import Alignment, MatchedTrajectories
from fgbaseline.compare.trajectory_comparison.inputs import Entry
from fgbaseline.data import Estimate, Excluded, HeldOut, Landmarks, Problem, Trajectory
from fgbaseline.data.display import Displayed
from fgbaseline.data.formats.recordings.ground_truth import match_stamps
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.triangulate_landmarks import landmarks_along
from fgbaseline.geometry import FloatArray, InputError, se3


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Pixels(Displayed):
    """Reprojection errors of one trajectory: tables of `compare.reprojection`, `used` being the problem's mask."""

    own: pd.DataFrame | None
    """residuals of its own landmarks; None without"""
    common: pd.DataFrame | None
    """residuals of its own landmarks over the observations that all trajectories with own landmarks have"""
    along: pd.DataFrame | None
    """residuals of landmarks triangulated along the trajectory; None where no frame has a pose"""
    frames: int
    """number of the recording's frames that have a pose"""
    notes: dict[str, str]
    """why a table is missing, by key"""

    @property
    def tables(self) -> dict[str, pd.DataFrame | None]:
        """Tables by their keys in the results."""
        return {"reprojection": self.own, "reprojection_common": self.common, "reprojection_along": self.along}


def paths_of(problem: Problem, entries: Sequence[Entry], offset: float) -> dict[str, FloatArray]:
    """Poses (T, 4, 4) of the problem's frames by name.

    A frame has the pose nearest in time within half an interval. `offset`, s, is added to the stamps of all entries
    but the first, the reference.
    """
    moved = [e.trajectory.later(offset) if offset and i else e.trajectory for i, e in enumerate(entries)]
    return {e.name: poses_of_frames(problem, path) for e, path in zip(entries, moved, strict=True)}


def pixels_of(problem: Problem, entries: Sequence[Entry], paths: Mapping[str, FloatArray]) -> dict[str, Pixels]:
    """Reprojection by name, each trajectory in its own world, without alignment."""
    estimates = {e.name: _estimate(problem, e.name, paths[e.name], e.landmarks) for e in entries}
    own = {name: compare.reprojection(problem.sequence, e) for name, e in estimates.items() if len(e.landmarks)}
    common = _common(problem, own)
    return {name: _pixels(problem, estimate, own.get(name), common) for name, estimate in estimates.items()}


def held_out_of(problem: Problem, held: HeldOut | None, paths: Mapping[str, FloatArray]) -> pd.DataFrame | None:
    """Paths ranked by held-out tracks: see `compare.held_out_ranking`; None without any.

    Paths without a pose at any frame are left out: no observation would be common to all.
    """
    known = {name: path for name, path in paths.items() if np.isfinite(path[:, 0, 0]).any()}
    if held is None or not known:
        return None
    return compare.held_out_ranking(compare.held_out_errors(problem.sequence, held, known, problem.pixel_variance))


def map_of(
    problem: Problem,
    paths: Mapping[str, FloatArray],
    reference: Entry,
    entry: Entry,
    matched: MatchedTrajectories,
) -> pd.DataFrame:
    """`compare.map_difference` of an entry's landmarks, aligned as its path is, from those of the reference.

    Raises InputError, saying why, where nothing can be compared.
    """
    assert reference.landmarks is not None
    assert entry.landmarks is not None
    motion = matched.alignment
    aligned = Estimate(
        name=entry.name,
        world_T_imu=motion.apply(paths[entry.name]),
        used=problem.mask,
        landmarks=_aligned(entry.landmarks, motion),
    )
    there = Estimate(reference.name, paths[reference.name], problem.mask, landmarks=reference.landmarks)
    table = compare.map_difference(problem.sequence, aligned, there)
    if table.empty:
        raise InputError(f"no landmark that {reference.name} has too is observed in a frame for which both have a pose")
    return table


def poses_of_frames(problem: Problem, trajectory: Trajectory) -> FloatArray:
    """Pose of each frame of the problem's sequence, (T, 4, 4), NaN where the trajectory has none."""
    poses = np.full((problem.n_frames, 4, 4), np.nan)
    frames, chosen = match_stamps(problem.sequence.t, trajectory.t)
    poses[frames] = trajectory.world_T_body[chosen]
    return poses


def up_of_problem(problem: Problem, trajectory: Trajectory) -> FloatArray | None:
    """The problem's up, (3,), in the world of a trajectory, by its first pose at a frame; None where there is none.

    The problem has up in the IMU's frame at frame 0; its increments lead from there to that frame.
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
    """Mask (n,) of the problem's observations that every table has."""
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


def _aligned(landmarks: Landmarks, motion: Alignment) -> Landmarks:
    position = motion.scale * landmarks.position @ motion.rotation.T + motion.translation
    return replace(landmarks, position=position, covariance=None)
