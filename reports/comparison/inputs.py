"""Inputs of a comparison, read and brought to one body frame: reference, estimates and the problem behind them."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, cast

import numpy as np

from fgbaseline.compare.trajectory_comparison.body_frames import (
    moved_body,
    with_body_recognized,
    with_length_unit_recognized,
    with_lever_arm,
)
from fgbaseline.compare.trajectory_comparison.conventions import Source, resolve
from fgbaseline.compare.trajectory_comparison.inputs import Entries, Entry
from fgbaseline.compare.trajectory_comparison.settings import Body, Settings
from fgbaseline.data import Trajectory
from fgbaseline.data.formats import ParsedTrajectory, read_landmarks, read_times
from fgbaseline.data.formats.files.file_errors import FilePath
from fgbaseline.data.formats.trajectories.format_detection import OpenedTrajectory, split_name
from fgbaseline.data.formats.trajectories.kitti import read_extrinsic
from fgbaseline.geometry import FloatArray, InputError, se3

from ..problem import names_in
from .sources import TrajectoryLike, opened

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Run
    from fgbaseline.data import HeldOut, Landmarks, Problem

    from .reference_run import ReferenceRun

Given: TypeAlias = TrajectoryLike | Source | OpenedTrajectory
"""a trajectory; the name of a reference may be that of a run's folder"""

GivenLandmarks: TypeAlias = "Sequence[FilePath] | Mapping[str, FilePath | Landmarks]"
"""`[NAME=]FILE` each, or landmarks by the name of their trajectory"""

NO_RUN = OpenedTrajectory | ParsedTrajectory | Trajectory
"""types of a reference that is known to be no run before the model of runs is imported"""

CUT_OFF = 0.01
"""largest share of a recording's frames that may be missing at the end of a file with a pose per frame"""
ONLINE = "-online"
"""suffix of a smoother's by-product: pose k from data up to frame k"""


def read_entries(
    reference: "Given | Run", estimates: Sequence[Given], landmarks: GivenLandmarks, settings: Settings
) -> Entries:
    """Reads all inputs. Raises InputError with the file and its fault."""
    run, problem, held = _background(reference, settings)
    own = opened(cast("Given", reference), settings.form) if run is None else run.trajectory(run.reference)
    sources = [own, *(opened(given, settings.form) for given in estimates)]
    first, *others = in_one_body(sources, settings, problem, run)
    beside = []
    if run is not None:
        first = replace(first, landmarks=run.landmarks(run.reference), trust=run.trust)
        beside = [
            Entry(run.trajectory(name), run.landmarks(name), by_product=name == f"{run.reference}{ONLINE}")
            for name in _beside(run, settings.beside)
        ]
    entries = _named_apart([first, *beside, *others])
    entries = _with_landmarks(entries, landmarks, [e.name for e in entries[1 + len(beside) :]], problem)
    if len(entries) == 1:
        raise InputError("estimate: there is nothing to compare; name at least one trajectory besides the reference")
    up = None if run is None or run.up is None else np.array(run.up)
    return Entries(entries[0], tuple(entries[1:]), problem, held, up, run is not None)


def _background(
    reference: "Given | Run", settings: Settings
) -> "tuple[ReferenceRun | None, Problem | None, HeldOut | None]":
    """The run that a reference is, in memory or by its folder, the problem, and the held-out tracks."""
    if settings.seed < 0:
        raise InputError(f"seed: expected a whole number from 0 on, got {settings.seed}")
    if isinstance(reference, NO_RUN) and settings.sequence is None and not settings.held_out:
        return None, None, None
    from fgbaseline.compare.estimate_comparison import Run

    from .reference_run import load_problem, read_reference_run, reference_in_memory

    run: ReferenceRun | None = None
    if isinstance(reference, Run):
        run = reference_in_memory(reference)
    elif isinstance(reference, str | os.PathLike) and Path(reference).is_dir():
        run = read_reference_run(Path(reference))
    return run, *load_problem(settings, run)


def in_one_body(
    sources: Sequence[Source], settings: Settings, problem: "Problem | None", run: "ReferenceRun | None" = None
) -> list[Entry]:
    """Entries, the reference first, with the poses of one body: the IMU, or the point of a reference of positions.

    Raises InputError for time units that nothing decides, and for an extrinsic that is needed and not known.
    """
    times, imu_T_cam = _frame_times(settings, problem), _extrinsic(settings, problem)
    reference, *estimates = [
        Entry(each.trajectory(times), each.landmarks, each.covariance, each.up, each.up_stated, each.remarks)
        for each in resolve(sources, times, settings)
    ]
    bodies: tuple[Body, Body] = ("imu" if run else settings.reference_body, settings.estimate_body)
    if settings.lever_arm is not None:
        if bodies[0] != bodies[1]:
            raise InputError(
                "lever-arm: it already ends at the reference's point; leave out --reference-body and --estimate-body"
            )
        estimates = [with_lever_arm(each, np.array(settings.lever_arm)) for each in estimates]
    elif not reference.trajectory.oriented and bodies[0] != bodies[1]:
        imu_T_cam = _required(imu_T_cam, reference)
        arm = imu_T_cam[:3, 3] if bodies[0] == "camera" else se3.inverse(imu_T_cam)[:3, 3]
        estimates = [with_lever_arm(each, arm) for each in estimates]
    elif reference.trajectory.oriented:
        if bodies[0] == "camera":
            reference = moved_body(reference, se3.inverse(_required(imu_T_cam, reference)))
        if bodies[1] == "camera":
            estimates = [moved_body(each, se3.inverse(_required(imu_T_cam, each))) for each in estimates]
    path = reference.trajectory
    estimates = [with_length_unit_recognized(path, each, settings) for each in estimates]
    return [reference, *(with_body_recognized(path, each, settings) for each in estimates)]


def _required(imu_T_cam: FloatArray | None, entry: Entry) -> FloatArray:
    path = entry.trajectory
    if imu_T_cam is None:
        raise InputError(f"{path.source or path.name}: its poses are the camera's; add --sequence or --extrinsic FILE")
    return imu_T_cam


def _frame_times(settings: Settings, problem: "Problem | None") -> list[FloatArray]:
    """Stamps, s, for files without them: of --times, else of the recording, whose last few may be missing."""
    if settings.times:
        given = settings.times
        return [np.asarray(t) if isinstance(t, np.ndarray) else read_times(t, settings.unit) for t in given]
    if problem is None:
        return []
    t = problem.sequence.t
    return [t[: len(t) - k] for k in range(int(CUT_OFF * len(t)) + 1)]


def _extrinsic(settings: Settings, problem: "Problem | None") -> FloatArray | None:
    if settings.extrinsic is None:
        return None if problem is None else problem.sequence.imu_T_cam
    if isinstance(settings.extrinsic, np.ndarray):
        if settings.extrinsic.shape != (4, 4):
            raise InputError(f"extrinsic: expected imu_T_cam (4, 4), got an array {settings.extrinsic.shape}")
        return np.asarray(settings.extrinsic, dtype=np.float64)
    return read_extrinsic(settings.extrinsic)


def _beside(run: "ReferenceRun", wanted: str) -> list[str]:
    others = [name for name in run.names if name != run.reference]
    if wanted in ("all", "none"):
        return others if wanted == "all" else []
    names = list(names_in(wanted))
    if unknown := next((name for name in names if name not in others), None):
        raise InputError(f"beside: the run has no '{unknown}' besides its reference; it has {', '.join(others)}")
    return names


def _named_apart(entries: list[Entry]) -> list[Entry]:
    """Entries with unique names: equal names get the folder's name in front, then a number at the end."""
    given = [entry.name for entry in entries]
    named: dict[str, Entry] = {}
    for entry in entries:
        folder = Path(entry.trajectory.source).parent.name
        name = f"{folder}-{entry.name}" if given.count(entry.name) > 1 and folder else entry.name
        unique = next(n for n in chain((name,), (f"{name}-{k}" for k in count(2))) if n not in named)
        named[unique] = replace(entry, trajectory=replace(entry.trajectory, name=valid_file_name(unique)))
    return list(named.values())


def valid_file_name(name: str) -> str:
    """The name; raises InputError where a file cannot have it."""
    if "/" in name or "\\" in name or name.startswith(".") or not name:
        raise InputError(f"{name!r} cannot be a file name; give the trajectory another: NAME=FILE")
    return name


def _with_landmarks(
    entries: list[Entry], given: GivenLandmarks, own: list[str], problem: "Problem | None"
) -> list[Entry]:
    """The entries with landmarks by name, or of `[NAME=]FILE`; a file without a name belongs to the only estimate."""
    if given and problem is None:
        raise InputError("landmarks: their reprojection needs the observations of a recording; add --sequence")
    found: dict[str, Landmarks] = {}
    named = given.items() if isinstance(given, Mapping) else [split_name(os.fspath(file)) for file in given]
    for name, file in named:
        if name is None:
            if len(own) != 1:
                raise InputError(f"{file}: it may belong to any of {len(own)} estimates; name one: NAME=FILE")
            name = own[0]
        if name not in own:
            raise InputError(f"landmarks: there is no estimate '{name}'; there are {', '.join(own)}")
        found[name] = read_landmarks(file) if isinstance(file, str | os.PathLike) else file
    merged = [replace(e, landmarks=found.get(e.name, e.landmarks)) for e in entries]
    for entry in merged:
        _require_known(entry, problem)
    return merged


def _require_known(entry: Entry, problem: "Problem | None") -> None:
    if problem is None or entry.landmarks is None or not len(entry.landmarks):
        return
    last, n = int(entry.landmarks.index[-1]), problem.sequence.n_landmarks
    if last >= n:
        raise InputError(
            f"{entry.name}: its landmark {last} is not one of the sequence's {n}; a run numbers the pieces of split "
            "tracks beyond the recording's, so give --sequence the folder of its fgbaseline export"
        )
