"""`fgbaseline.run`: the command `run` for Python, with arrays and functions where it has files and names."""

import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Literal, TypeAlias

from fgbaseline.compare.trajectory_comparison.conventions import Source
from fgbaseline.data import (
    LandmarkMode,
    Problem,
    Sequence,
    TimeUnit,
    Trajectory,
    Truth,
    estimator_names,
    find_estimator,
)
from fgbaseline.data.estimator_runner import no_progress
from fgbaseline.data.formats.file_errors import FilePath, as_path
from fgbaseline.data.user_estimator import load_all
from fgbaseline.geometry import InputError

from ..comparison.sources import Array, TrajectoryLike, by_name, opened
from ..python_arguments import for_python
from .defaults import BATCH_OBSERVATIONS, DEFAULT_ESTIMATORS, names_in
from .estimation import read_added, solve
from .problem import (
    RunSettings,
    build_problem,
    check_estimators,
    hold_out_tracks,
    import_estimators,
    read_sequence,
    with_defaults,
)
from .report import RunReport

Solver: TypeAlias = Callable[..., object]
"""`solve(problem, progress=None) -> Estimate`; another return value becomes a row that failed, with the reason"""


@for_python
def run(
    recording: FilePath | Sequence | Problem | None = None,
    *,
    estimators: str | Solver | Iterable[str | Solver] | Mapping[str, str | Solver] | None = None,
    add: TrajectoryLike | Iterable[TrajectoryLike] | Mapping[str, TrajectoryLike] = (),
    add_body: Literal["imu", "camera"] | None = None,
    add_time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    add_offset: float = 0.0,
    preset: Literal["calibrated", "documented"] = "calibrated",
    features: int | Literal["all"] | None = None,
    landmarks: Literal["in-turn", "held"] = "in-turn",
    truth: FilePath | Trajectory | Truth | Array | tuple[Array, Array] | None = None,
    truth_frame: Literal["imu", "camera"] | None = None,
    truth_up: tuple[float, float, float] | None = None,
    as_recorded: bool = False,
    imu: FilePath | None = None,
    imu_calibration: FilePath | None = None,
    velocities: FilePath | None = None,
    extrinsic: FilePath | None = None,
    cameras: Literal["stereo", "left"] | None = None,
    right: FilePath | None = None,
    calibration: FilePath | None = None,
    times: FilePath | None = None,
    topics: str | Iterable[str] = (),
    settings: FilePath | None = None,
    time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    repairs: FilePath | None = None,
    held_out: float = 0.0,
    seed: int = 0,
    processes: int = 1,
    progress: bool = False,
) -> RunReport:
    """Runs estimators on a recording and compares them, as `fgbaseline run` does; nothing is written.

        result = fgbaseline.run("drive.npz", estimators=["ekf", "isam2", my_filter])
        result.table, result.verdict, result.figures()
        result.report("out/drive")

    Args:
        recording: A file, a `Sequence` or a `Problem`; by default a simulated drive with known truth.
        estimators: Registered names, functions `solve(problem, progress=None) -> Estimate`, or "FILE:FUNCTION"; a
            mapping names them. Functions alone run beside the default names, which are those of the command.
        add: Trajectories beside the estimators: as those of `compare_trajectories`, aligned to the reference.
        add_body: Body whose poses they have; by default the imu.
        add_time_unit: Unit of their stamps, where a file leaves it open.
        add_offset: Added to their stamps, s.
        preset: The problem: diagnosed and repaired, or as the source paper has it.
        features: Number of landmarks, those with the most observations; by default all (documented: 1000).
        landmarks: Landmarks of the documented SLAM: updated in turn with the pose, or held.
        truth: Ground truth: a file, a `Truth`, poses (T, 4, 4) by frame, or stamps (n,), s, with poses (n, 4, 4).
        truth_frame: Body whose poses the ground truth has; a `Truth` has those of the imu.
        truth_up: Up in the world of the ground truth of raw inertial data; by default its file's comment `# up x y z`,
            else its z axis within 0.5° of what the samples measure, and beyond that what they measure.
        as_recorded: No diagnosis and no repairs; the noise is assumed.
        imu: CSV of raw inertial samples, in place of the recording's velocities.
        imu_calibration: YAML of their noise; by default assumed.
        velocities: CSV of body velocities, in place of the recording's motion.
        extrinsic: File with imu_T_cam of the left camera, a line of 12 numbers.
        cameras: Of images: a pair, or the left camera alone with raw inertial samples; by default what there is.
        right: Folder of the right images, where the recording is the folder of the left ones.
        calibration: YAML of the cameras of two folders or a bag, Kalibr or OpenCV.
        times: Stamps of the images of two folders, a line for each.
        topics: Topics of a bag: left, right and, if any, the IMU; by default by their types.
        settings: TOML file of the settings of the tracker.
        time_unit: Unit of the recording's stamps; by default detected.
        repairs: TOML file of user-specified repairs.
        held_out: Share of the tracks that diagnosis and estimators do not use; they rank the paths.
        seed: Seed of the simulated drive and of the choice of held-out tracks.
        processes: Number of processes that share diagnosis and comparison.
        progress: Whether progress is printed on standard error.

    Raises InputError, in one sentence, for an invalid recording or keyword. An estimator that raises an exception
    becomes a failed result; the others go on.
    """
    names, functions = named_estimators(() if estimators is None else estimators)
    is_default = estimators is None or (bool(names) and len(functions) == len(names))
    chosen = RunSettings(
        sequence=as_path(recording),
        preset=preset,
        estimators=(*DEFAULT_ESTIMATORS, *names) if is_default else names,
        batch_up_to=BATCH_OBSERVATIONS if is_default else 0,
        functions=functions,
        features=features,
        landmarks=LandmarkMode(landmarks),
        truth=_truth_source(truth),
        truth_frame=truth_frame,
        truth_up=truth_up,
        as_recorded=as_recorded,
        imu=as_path(imu),
        imu_calibration=as_path(imu_calibration),
        velocities=as_path(velocities),
        extrinsic=as_path(extrinsic),
        cameras=cameras,
        right=as_path(right),
        calibration=as_path(calibration),
        times=as_path(times),
        time_unit=None if time_unit is None else TimeUnit(time_unit),
        topics=names_in(topics) if isinstance(topics, str) else tuple(topics),
        tracker=as_path(settings),
        repairs=as_path(repairs),
        held_out=held_out,
        seed=seed,
        add=tuple(opened(each, name=name) for name, each in by_name(add)),
        add_body=add_body,
        add_time_unit=add_time_unit,
        add_offset=add_offset,
    )
    check_estimators(chosen.estimators, chosen.functions)
    sequence = read_sequence(chosen)
    chosen = with_defaults(chosen, sequence)
    added = read_added(chosen)
    kept, held = hold_out_tracks(sequence, chosen)
    problem = build_problem(kept, chosen, processes)
    import_estimators(chosen.estimators)
    watch = no_progress
    if progress:
        from ..progress import reporter

        watch = reporter().estimator
    solved = solve(problem, chosen, watch, held, processes, added)
    return RunReport(**{field.name: getattr(solved, field.name) for field in fields(solved)})


def named_estimators(
    given: str | Solver | Iterable[str | Solver] | Mapping[str, str | Solver],
) -> tuple[tuple[str, ...], dict[str, Solver]]:
    """Names of all estimators in order, and the unregistered functions by name.

    Raises InputError for what is neither name nor function, for a function without a name, and for the name of another
    registered estimator.
    """
    if isinstance(given, Mapping):
        each = list(given.items())
    elif not (callable(given) or isinstance(given, Iterable)):
        raise InputError(f"estimators: expected names and functions, got {type(given).__name__}")
    else:
        each = [("", one) for one in ([given] if isinstance(given, str) or callable(given) else given)]
    names: list[str] = []
    functions: dict[str, Solver] = {}
    for wanted, one in each:
        if isinstance(one, str) and ":" not in one and wanted in ("", one):
            names += names_in(one)
            continue
        if isinstance(one, str):
            ((name, function),) = load_all((f"{wanted}={one}" if wanted else one,)).items()
        elif callable(one):
            name, function = wanted or _name_of(one), one
        else:
            raise InputError(f"estimators: expected names and functions, got {type(one).__name__}")
        names.append(name)
        if name not in estimator_names():
            functions[name] = function
        elif find_estimator(name) is not function:
            raise InputError(f"estimators: '{name}' is installed already; name the function, such as {{'mine': solve}}")
    return tuple(names), functions


def _name_of(function: Solver) -> str:
    """Registered name of a function, else its own."""
    name = str(getattr(function, "__name__", ""))
    if (registered := name.replace("_", "-")) in estimator_names() and find_estimator(registered) is function:
        return registered
    if not re.fullmatch(r"\w+", name):
        raise InputError(f"estimators: {function!r} has no name; give it one, such as {{'mine': solve}}")
    return name


def _truth_source(
    truth: FilePath | Trajectory | Truth | Array | tuple[Array, Array] | None,
) -> Path | Source | Truth | None:
    """Ground truth as `RunSettings` has it: a path that is not read yet, a `Source` or a `Truth`."""
    if isinstance(truth, str | os.PathLike):
        return Path(truth)
    return truth if truth is None or isinstance(truth, Truth) else opened(truth, name="truth")
