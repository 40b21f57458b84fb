"""Settings of a run, and the estimators that they name."""

import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

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
from fgbaseline.data.estimators.user_estimator import load_all
from fgbaseline.data.formats import BodyFrame, ParsedTrajectory
from fgbaseline.data.problem.documented import DEFAULT_FEATURES
from fgbaseline.data.tracking import Cameras
from fgbaseline.geometry import InputError

from . import DEFAULT_ESTIMATORS, ONE_CAMERA_ESTIMATORS, names_in

BESIDE = ("velocities", "extrinsic")
IMAGES = ("cameras", "right", "calibration", "times", "tracker")
"""settings that only recordings of images have"""
IF_GIVEN = (*BESIDE, "imu", "imu_calibration", *IMAGES, "topics", "truth_up")
Solver: TypeAlias = Callable[..., object]
"""`solve(problem, progress=None) -> Estimate`; another return value becomes a row that failed, with the reason"""


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Settings of the user."""

    sequence: Path | Sequence | Problem | None = None
    """recording in a file or in memory, or a problem; None for the simulated drive"""
    preset: Literal["calibrated", "documented"] = "calibrated"
    estimators: tuple[str, ...] = DEFAULT_ESTIMATORS
    batch_up_to: int = 0
    """number of observations up to which `batch`, started at the solution of `isam2`, is added to `estimators`"""
    features: int | Literal["all"] | None = None
    """None for the preset's default"""
    landmarks: LandmarkMode = LandmarkMode.UPDATED
    truth: Path | ParsedTrajectory | Trajectory | Truth | None = None
    truth_frame: BodyFrame | None = None
    truth_up: tuple[float, float, float] | None = None
    """up in the world of the ground truth; None to find it"""
    seed: int = 0
    as_recorded: bool = False
    """no diagnosis, no repairs, assumed noise"""
    time_unit: TimeUnit | None = None
    """unit of the recording's stamps; None to detect it"""
    held_out: float = 0.0
    """share of the tracks that diagnosis and estimators do not get; trajectories are ranked by them"""
    repairs: Path | None = None
    """TOML file of user-specified repairs"""
    velocities: Path | None = None
    """CSV of body velocities, in place of the recording's motion"""
    extrinsic: Path | None = None
    """imu_T_cam of the left camera, in place of the recording's"""
    imu: Path | None = None
    """CSV of raw inertial samples, in place of the recording's velocities"""
    imu_calibration: Path | None = None
    """YAML of their noise"""
    cameras: Cameras | None = None
    """cameras of a recording of images: a pair, or the left one alone; None for a pair where there is one"""
    right: Path | None = None
    """folder of right images, where the sequence is that of the left ones"""
    calibration: Path | None = None
    """YAML of the cameras of two folders or a bag"""
    times: Path | None = None
    """stamps of the images of two folders"""
    tracker: Path | None = None
    """TOML file of the settings of the tracker"""
    topics: tuple[str, ...] = ()
    """topics of a bag: left, right and, if any, the IMU"""
    functions: Mapping[str, Callable[..., object]] = field(default_factory=dict)
    """name -> function of estimators that are not registered, such as those of the user's files"""
    add: tuple[str | ParsedTrajectory | Trajectory, ...] = ()
    """trajectories beside the estimators: `[NAME=]FILE`, or parsed already"""
    add_body: BodyFrame | None = None
    """body whose poses the added trajectories have; None for the IMU"""
    add_time_unit: Literal["s", "ms", "us", "ns"] | None = None
    """unit of ambiguous time stamps"""
    add_offset: float = 0.0
    """time offset added to the stamps of the added trajectories, s"""

    def __post_init__(self) -> None:
        if not (self.sequence is None or isinstance(self.sequence, Path | Sequence | Problem)):
            raise InputError(f"recording: expected a file, a Sequence or a Problem, got {type(self.sequence).__name__}")
        if self.seed < 0:
            raise InputError(f"seed: expected a whole number from 0 on, got {self.seed}")

    def record(self) -> dict[str, str | int | float | bool | None]:
        """The settings as `summary.json` has them, those of motion and images only where they are given."""
        given = {f.name: _recorded(getattr(self, f.name)) for f in fields(self) if f.name != "batch_up_to"}
        given["features"] = self.features or (DEFAULT_FEATURES if self.preset == "documented" else "all")
        return {name: value for name, value in given.items() if value is not None or name not in IF_GIVEN}


POSED = {
    name: getattr(RunSettings(), name)
    for name in ("preset", "features", "landmarks", "as_recorded", "held_out", "repairs", "truth")
}
"""settings that a given problem already fixes: name -> value that changes nothing"""


def _recorded(value: Any) -> str | int | float | bool | None:
    """A setting as text or number: a path as it is, the source or name of what is in memory, names with commas."""
    if value is None or isinstance(value, int | float):
        return value
    if isinstance(value, Mapping):
        return ",".join(f"{name}={_source(function)}" for name, function in value.items()) or None
    if isinstance(value, tuple):
        return ",".join(str(each) if isinstance(each, str | float) else each.name for each in value) or None
    if isinstance(value, str | Path):
        return str(value)
    if isinstance(value, Problem):
        return _recorded(value.sequence)
    return str(value.source if isinstance(value, Truth) else value.source or value.name)


def _source(function: Callable[..., object]) -> str:
    """File and name of a function, as far as they are known."""
    name = str(getattr(function, "__qualname__", type(function).__name__))
    try:
        return f"{inspect.getsourcefile(function)}:{name}"
    except TypeError:  # one written in C, or an object that can be called
        return name


def with_defaults(settings: RunSettings, sequence: Sequence) -> RunSettings:
    """The settings for a recording: with one camera, other default estimators."""
    named = settings.estimators[: len(DEFAULT_ESTIMATORS)] != DEFAULT_ESTIMATORS or settings.batch_up_to == 0
    if named or not sequence.monocular:
        return settings
    return replace(settings, estimators=(*ONE_CAMERA_ESTIMATORS, *settings.estimators[len(DEFAULT_ESTIMATORS) :]))


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


def check_estimators(names: tuple[str, ...], functions: Mapping[str, Callable[..., object]] | None = None) -> None:
    """Raises InputError for no name, an unknown one, or one given twice; `functions` are not installed, by name."""
    installed = [*estimator_names(), *(functions or {})]
    if not names:
        raise InputError(f"estimators: name at least one of {', '.join(installed)}")
    for name in names:
        if name not in installed:
            raise InputError(f"estimators: there is no '{name}'; installed are {', '.join(installed)}")
        if names.count(name) > 1:
            raise InputError(f"estimators: '{name}' is named twice; name it once")
        if "/" in name or "\\" in name or name.startswith("."):
            raise InputError(f"estimators: '{name}' cannot be a file name; register the estimator under another")


def import_estimators(names: tuple[str, ...]) -> None:
    """Imports the estimators now; an import that fails is reported later, as the failure of that estimator."""
    for name in names:
        with suppress(Exception):
            find_estimator(name)
