"""Solution of a run's problem: estimators in turn, trajectories from files beside them, and the comparison of all."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from fgbaseline.compare.estimate_comparison import Run, compare_all, reference_among
from fgbaseline.compare.trajectory_comparison.computation import matched_poses
from fgbaseline.compare.trajectory_comparison.conventions import Source
from fgbaseline.compare.trajectory_comparison.reprojection import up_of_problem
from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data import Estimate, Excluded, HeldOut, Problem, Trajectory, find_estimator
from fgbaseline.data.estimators.runner import Watch, no_progress, solve_all
from fgbaseline.data.triangulate_landmarks import landmarks_along
from fgbaseline.geometry import InputError

from ..comparison.inputs import in_one_body, valid_file_name
from ..comparison.sources import opened
from ..problem.settings import RunSettings

LEVEL = 1.0
"""largest angle between the ups of two level worlds, deg; beyond it a yaw alignment would leave a tilt as error"""


@dataclass(frozen=True, eq=False, slots=True)
class Added:
    """Trajectories beside the estimators, parsed but not yet aligned."""

    sources: Mapping[str, Source]
    settings: Settings


def read_added(settings: RunSettings) -> Added:
    """Reads the trajectory files of `add`. Raises InputError for a bad file, and for a name that is taken."""
    options = Settings(
        offset=settings.add_offset, time_unit=settings.add_time_unit, estimate_body=settings.add_body or "imu"
    )
    if not settings.add and options != Settings():
        raise InputError("add: its body, time unit or offset is given without a trajectory; add --add NAME=PATH")
    sources: dict[str, Source] = {}
    for given in settings.add:
        source = opened(given)
        name = valid_file_name(source.name)
        if name in sources or name in settings.estimators:
            raise InputError(f"add: the name '{name}' is taken; give the trajectory another: NAME={_path(given)}")
        sources[name] = source
    return Added(sources, options)


def solve(
    problem: Problem,
    settings: RunSettings,
    watch: Watch = no_progress,
    held: HeldOut | None = None,
    processes: int = 1,
    added: Added | None = None,
) -> Run:
    """Solves the problem with each estimator in turn, and compares the estimates with `processes`."""
    functions = settings.functions
    if batch_is_added(problem, settings):
        batch: Callable[..., object] = find_estimator("batch")
        functions = {**functions, "batch": partial(batch, from_dead_reckoning=False)}
        settings = replace(settings, estimators=(*settings.estimators, "batch"))
    estimates = solve_all(problem, settings.estimators, watch, functions)
    captions: dict[str, str] = {}
    reference = reference_among(estimates)
    for name, source in ({} if added is None else added.sources).items():
        assert added is not None
        try:
            if reference is None:
                raise InputError("no estimator succeeded, so there is nothing to align it to")
            estimates[name], captions[name] = _aligned(problem, estimates[reference], name, source, added.settings)
        except InputError as error:
            estimates[name] = Estimate.failed(name, str(error), problem.n_frames, len(problem.excluded))
            captions[name] = "it could not be aligned"
    return compare_all(problem, estimates, settings.record(), held, processes, captions)


def batch_is_added(problem: Problem, settings: RunSettings) -> bool:
    """Whether `batch` shows if the reference has converged, though it was not asked for (see `batch_up_to`)."""
    return (
        "isam2" in settings.estimators
        and "batch" not in settings.estimators
        and 0 < int(problem.mask.sum()) <= settings.batch_up_to
    )


def _aligned(
    problem: Problem, reference: Estimate, name: str, source: Source, settings: Settings
) -> tuple[Estimate, str]:
    """Trajectory as an estimate in the world of the reference, and a caption on pairing and alignment.

    It is aligned by yaw and position where both worlds are level, else by SE(3), as `compare` aligns it to the folder
    of a run. Landmarks are triangulated along it. Raises InputError where it cannot be paired.
    """
    there = Trajectory.of_frames(problem.sequence.t, reference.world_T_imu, reference.name)
    first, entry = in_one_body([there, source], settings, problem)
    if not entry.trajectory.oriented:
        raise InputError(f"{name} has positions only; fgbaseline compare takes it")
    up = up_of_problem(problem, entry.trajectory.later(settings.offset) if settings.offset else entry.trajectory)
    tilt = 0.0 if up is None else float(np.rad2deg(np.arccos(np.clip(up @ problem.sequence.up, -1.0, 1.0))))
    settings = replace(settings, align="yaw" if tilt <= LEVEL else "se3")
    matched, _ = matched_poses(first, entry, problem.sequence.up, settings)
    frames = np.searchsorted(problem.sequence.t, matched.reference.t)
    poses = np.full((problem.n_frames, 4, 4), np.nan)
    poses[frames] = matched.estimate.world_T_body
    covariance = None
    if entry.covariance is not None:
        covariance = np.full((problem.n_frames, 6, 6), np.nan)
        chosen = np.searchsorted(entry.trajectory.t + matched.offset, matched.estimate.t)
        covariance[frames] = entry.covariance[chosen]
    known = np.isfinite(poses[:, 0, 0])[problem.sequence.observations.frame]
    seen = replace(problem, excluded=np.where(known, problem.excluded, np.uint8(Excluded.GEOMETRY)))
    estimate = Estimate(
        name=name,
        world_T_imu=poses,
        used=np.zeros(len(problem.excluded), dtype=np.bool_),
        covariance=covariance,
        landmarks=landmarks_along(seen, poses),
        seconds_total=np.nan,
    )
    why = f"; SE(3), since up in its world is {tilt:.1f}° off" if tilt > LEVEL else ""
    file = entry.trajectory.source or "memory"
    return estimate, f"{file}, {matched.caption}, to {reference.name}{why}; landmarks triangulated along it"


def _path(given: str | Source) -> str:
    return str(Path(given.partition("=")[2] or given)) if isinstance(given, str) else "PATH"
