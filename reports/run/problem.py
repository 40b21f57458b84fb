"""Settings of a run, and the problem they make of a recording."""

import inspect
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fgbaseline.data import (
    HeldOut,
    LandmarkMode,
    Problem,
    Sequence,
    TimeUnit,
    Trajectory,
    Truth,
    attach_truth,
    documented,
    estimator_names,
    find_estimator,
    read,
)
from fgbaseline.data.finding import OF_THE_FILE
from fgbaseline.data.formats import BodyFrame, ParsedTrajectory
from fgbaseline.data.problem.documented import DEFAULT_FEATURES
from fgbaseline.data.tracking import Cameras, ImageOptions, Pictures, has_images
from fgbaseline.diagnosis import (
    AsRecordedSettings,
    calibrated,
    hold_out,
    known_units,
    read_repairs,
    unit_findings,
    unusable,
)
from fgbaseline.diagnosis.conventions.units import evidence
from fgbaseline.geometry import InputError

from .defaults import DEFAULT_ESTIMATORS, ONE_CAMERA_ESTIMATORS

MIN_TRUTH_SHARE = 0.5
"""smallest share of frames with ground truth that is not remarked on"""
BESIDE = ("velocities", "extrinsic")
IMAGES = ("cameras", "right", "calibration", "times", "tracker")
"""settings that only recordings of images have"""
IF_GIVEN = (*BESIDE, "imu", "imu_calibration", *IMAGES, "topics", "truth_up")
TRACKS = "tracks.npz"
"""file of the tracks in the folder of a run on images"""


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


def read_sequence(settings: RunSettings, pictures: Pictures | None = None) -> Sequence:
    """Reads or simulates the recording with its ground truth; `pictures` gets its images. Raises InputError."""
    sequence = _read(settings, pictures)
    if settings.truth_up is None:
        return sequence
    length = float(np.linalg.norm(settings.truth_up))
    if sequence.truth is None or not (np.isfinite(length) and length > 0.0):
        given = ",".join(f"{x:g}" for x in settings.truth_up)
        why = (
            "is not a direction" if sequence.truth is not None else "is given without a ground truth; add --truth FILE"
        )
        raise InputError(f"truth-up: {given} {why}")
    return replace(sequence, truth=replace(sequence.truth, up=np.array(settings.truth_up) / length))


def _read(settings: RunSettings, pictures: Pictures | None) -> Sequence:
    if settings.sequence is None:
        if settings.time_unit is not None:
            raise InputError("time-unit: the simulated drive has stamps in seconds; give a RECORDING with --time-unit")
        if settings.truth is not None or settings.truth_frame is not None:
            raise InputError("truth: the simulated drive has its own truth; give a RECORDING with --truth")
        _require_none(settings, (*BESIDE, *IMAGES), "give a RECORDING with it")
        if settings.imu is not None or settings.imu_calibration is not None:
            raise InputError("imu: the simulated drive has its own motion; give a RECORDING with --imu")
        from fgbaseline.data.simulate import Simulation, simulate

        return simulate(Simulation(seed=settings.seed))
    _require_truth_frame(settings)
    if not isinstance(settings.sequence, Path):
        sequence = _in_memory(settings.sequence, settings)
    elif has_images(settings.sequence):
        sequence = _of_images(settings, pictures)
        if isinstance(settings.truth, Path):
            return sequence  # with this truth in place of its own
    else:
        _require_none(settings, IMAGES, "it belongs to a recording of images; leave it out")
        sequence = read(
            settings.sequence,
            None,
            None,
            settings.time_unit,
            settings.imu,
            settings.imu_calibration,
            settings.velocities,
            settings.extrinsic,
        )
    truth = settings.truth
    if truth is None:
        return sequence
    if isinstance(truth, Truth):
        return sequence.with_truth(truth)
    if isinstance(truth, ParsedTrajectory):
        truth = truth.trajectory(times=[sequence.t])
    return attach_truth(sequence, truth, settings.truth_frame)


def _require_truth_frame(settings: RunSettings) -> None:
    """Raises InputError where the body of the true poses is missing, or stated of nothing."""
    truth, frame = settings.truth, settings.truth_frame
    if frame is not None and (truth is None or isinstance(truth, Truth)):
        why = "without a ground truth; add --truth FILE" if truth is None else "with a Truth, whose body is the imu"
        raise InputError(f"truth-frame: '{frame}' is given {why}")
    if frame is None and not (truth is None or isinstance(truth, Truth)):
        name = truth if isinstance(truth, Path) else truth.name
        raise InputError(f"truth: the body of the poses in {name} is unknown; add --truth-frame camera or imu")


def _in_memory(given: Sequence | Problem, settings: RunSettings) -> Sequence:
    """Recording given in memory, or that of a given problem. Raises InputError for settings that do not apply to it."""
    for name in ("time_unit", "imu", "imu_calibration", *BESIDE, *IMAGES):
        if getattr(settings, name) is not None:
            raise InputError(f"{name.replace('_', '-')}: it is for a recording in a file; leave it out")
    if isinstance(given, Sequence):
        return given
    for name, usual in POSED.items():
        if getattr(settings, name) != usual:
            raise InputError(f"{name.replace('_', '-')}: the problem is posed already; leave it out")
    return given.sequence


def _of_images(settings: RunSettings, pictures: Pictures | None) -> Sequence:
    from fgbaseline.data.tracking.sources.image_recording import TruthFile

    from .images import tracked  # OpenCV is imported where there are images

    if settings.time_unit is not None:
        raise InputError("time-unit: the form of these images states the unit of their stamps; leave it out")
    assert isinstance(settings.sequence, Path)
    names = ("cameras", "right", "calibration", "times", "topics", "imu", "imu_calibration", "velocities", "extrinsic")
    options = ImageOptions(**{name: getattr(settings, name) for name in names})
    truth, body = settings.truth, settings.truth_frame
    given = TruthFile(truth, body) if isinstance(truth, Path) and body is not None else None
    found = tracked(settings.sequence, options, settings.tracker, motion=True, truth=given, pictures=pictures)
    return found.sequence(given)


def _require_none(settings: RunSettings, names: tuple[str, ...], advice: str) -> None:
    """Raises InputError for the first of these settings that is given."""
    for name in names:
        if getattr(settings, name) is not None:
            raise InputError(f"{name}: {getattr(settings, name)} is given without need; {advice}")


def hold_out_tracks(sequence: Sequence, settings: RunSettings) -> tuple[Sequence, HeldOut | None]:
    """Splits a recording into what diagnosis and estimators use, and the held-out tracks. Raises InputError."""
    return hold_out(sequence, settings.held_out, settings.seed) if settings.held_out != 0.0 else (sequence, None)


def build_problem(sequence: Sequence, settings: RunSettings, processes: int = 1) -> Problem:
    """Builds the problem of a preset, with `processes` for its diagnosis; one that is given is left as it is.

    Raises InputError.
    """
    if isinstance(settings.sequence, Problem):
        return settings.sequence
    if settings.repairs is not None and (settings.as_recorded or settings.preset == "documented"):
        why = "--as-recorded" if settings.as_recorded else "the documented preset"
        raise InputError(f"repairs: {why} uses no repairs; leave out one of the two")
    if len(sequence.observations) and (reason := unusable(sequence)):
        raise InputError(f"{sequence.source}: {reason}")
    if sequence.imu is None and (settings.as_recorded or settings.preset == "documented"):
        _require_units(sequence)
    repairs = None if settings.repairs is None else read_repairs(settings.repairs)
    features = None if settings.features == "all" else settings.features
    if settings.preset == "documented":
        if settings.features is None:
            features = DEFAULT_FEATURES
        return documented(sequence, features, settings.landmarks)
    assumed = AsRecordedSettings() if settings.as_recorded else None
    return calibrated(sequence, features, settings=assumed, repairs=repairs, processes=processes)


def preliminary_remarks(problem: Problem) -> list[str]:
    """Sentences that a run prints first: faults of the file, an offset that stays, and ground truth for few frames."""
    left = [f for f in problem.findings if f.code == "time_offset" and f.after == f.before]
    sentences = [finding.sentence for finding in problem.findings if finding.code in OF_THE_FILE]
    sentences += [finding.sentence for finding in left]
    truth = problem.sequence.truth
    if truth is not None and truth.known.mean() < MIN_TRUTH_SHARE:
        sentences += [remark for remark in problem.sequence.remarks if "ground truth" in remark.lower()]
    return sentences


def _require_units(sequence: Sequence) -> None:
    """Raises InputError for a recording in units other than SI, for a preset without repairs."""
    units = known_units(sequence)
    if units.doubt:
        raise InputError(f"{sequence.source}: {units.doubt}")
    wrong = [finding.sentence.rstrip(".").split("; multiplied")[0] for finding in unit_findings(units, sequence)]
    if wrong:
        raise InputError(
            f"{sequence.source}: {'. '.join(wrong)} ({evidence(units)}). Without repairs this is a different motion; "
            "convert the file, or repair it with --preset calibrated and without --as-recorded"
        )
