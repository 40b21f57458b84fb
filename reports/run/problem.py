"""Settings of a run, and the problem they make of a recording."""

import inspect
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from fgbaseline.data import (
    HeldOut,
    LandmarkMode,
    Problem,
    Sequence,
    TimeUnit,
    Trajectory,
    documented,
    estimator_names,
    find_estimator,
    read,
)
from fgbaseline.data.finding import OF_THE_FILE
from fgbaseline.data.formats import BodyFrame
from fgbaseline.data.problem.documented import DEFAULT_FEATURES
from fgbaseline.diagnosis import Calibration, calibrated, hold_out, known_units, read_repairs, unit_findings, unusable
from fgbaseline.diagnosis.conventions.units import evidence
from fgbaseline.geometry import InputError

MIN_TRUTH_SHARE = 0.5
"""smallest share of frames with ground truth that is not remarked on"""
MARK = "summary.json"
"""the file that marks a run's folder"""


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Settings of the user."""

    sequence: Path | None = None
    """None for the simulated drive"""
    preset: Literal["calibrated", "documented"] = "calibrated"
    estimators: tuple[str, ...] = ("dead-reckoning", "ekf", "isam2", "isam2-online")
    batch_up_to: int = 0
    """number of observations up to which `batch`, started at the answer of `isam2` only, is added to them"""
    features: int | Literal["all"] | None = None
    """None for the preset's default"""
    landmarks: LandmarkMode = LandmarkMode.UPDATED
    truth: Path | None = None
    truth_frame: BodyFrame | None = None
    seed: int = 0
    as_recorded: bool = False
    """no diagnosis, no repairs, assumed noise"""
    time_unit: TimeUnit | None = None
    """of the recording's stamps; None to detect it"""
    held_out: float = 0.0
    """share of the tracks kept from diagnosis and estimators, to judge the paths by"""
    imu: Path | None = None
    """CSV of raw inertial samples, in place of the recording's velocities"""
    imu_calibration: Path | None = None
    """YAML of their noise"""
    repairs: Path | None = None
    """TOML file of user-specified repairs"""
    functions: Mapping[str, Callable[..., object]] = field(default_factory=dict)
    """estimators among the names that are not installed, such as those of the user's files"""
    add: tuple[str | Trajectory, ...] = ()
    """trajectories beside the estimators: `[NAME=]FILE`"""
    add_body: BodyFrame | None = None
    """body whose poses they have; None for the IMU"""
    add_time_unit: Literal["s", "ms", "us", "ns"] | None = None
    """of ambiguous time stamps"""
    add_offset: float = 0.0
    """added to their stamps, s"""

    def record(self) -> dict[str, str | int | float | bool | None]:
        """The settings as `summary.json` has them."""
        return {
            "sequence": None if self.sequence is None else str(self.sequence),
            "preset": self.preset,
            "estimators": ",".join(self.estimators),
            "features": self.features or (DEFAULT_FEATURES if self.preset == "documented" else "all"),
            "landmarks": str(self.landmarks),
            "truth": None if self.truth is None else str(self.truth),
            "truth_frame": self.truth_frame,
            "seed": self.seed,
            "as_recorded": self.as_recorded,
            "time_unit": None if self.time_unit is None else str(self.time_unit),
            "held_out": self.held_out,
            "repairs": None if self.repairs is None else str(self.repairs),
            **{
                name: str(path)
                for name, path in (("imu", self.imu), ("imu_calibration", self.imu_calibration))
                if path is not None
            },
            "functions": ",".join(f"{name}={_source(function)}" for name, function in self.functions.items()) or None,
            "add": ",".join(t.name if isinstance(t, Trajectory) else t for t in self.add) or None,
            "add_body": self.add_body,
            "add_time_unit": self.add_time_unit,
            "add_offset": self.add_offset,
        }


def _source(function: Callable[..., object]) -> str:
    """File and name of a function, as far as they are known."""
    name = str(getattr(function, "__qualname__", type(function).__name__))
    try:
        return f"{inspect.getsourcefile(function)}:{name}"
    except TypeError:  # one written in C, or an object that can be called
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
    """Imports the estimators; one that cannot be imported fails later, with its reason."""
    for name in names:
        with suppress(Exception):
            find_estimator(name)


def read_sequence(settings: RunSettings) -> Sequence:
    """Reads or simulates the recording with its ground truth. Raises InputError."""
    if settings.sequence is None:
        if settings.time_unit is not None:
            raise InputError("time-unit: the simulated drive has stamps in seconds; give a SEQUENCE with --time-unit")
        if settings.truth is not None or settings.truth_frame is not None:
            raise InputError("truth: the simulated drive has its own truth; give a SEQUENCE with --truth")
        if settings.imu is not None or settings.imu_calibration is not None:
            raise InputError("imu: the simulated drive has its own motion; give a SEQUENCE with --imu")
        from fgbaseline.data.simulate import Simulation, simulate

        return simulate(Simulation(seed=settings.seed))
    if settings.truth is not None and settings.truth_frame is None:
        raise InputError(
            f"truth: the body of the poses in {settings.truth} is unknown; add --truth-frame camera or imu"
        )
    if settings.truth is None and settings.truth_frame is not None:
        raise InputError(f"truth-frame: '{settings.truth_frame}' is given without a ground truth; add --truth FILE")
    return read(
        settings.sequence,
        settings.truth,
        settings.truth_frame,
        settings.time_unit,
        settings.imu,
        settings.imu_calibration,
    )


def hold_out_tracks(sequence: Sequence, settings: RunSettings) -> tuple[Sequence, HeldOut | None]:
    """Splits a recording into what diagnosis and estimators use, and the held-out tracks. Raises InputError."""
    return hold_out(sequence, settings.held_out, settings.seed) if settings.held_out != 0.0 else (sequence, None)


def build_problem(sequence: Sequence, settings: RunSettings, processes: int = 1) -> Problem:
    """Builds the problem of a preset, with `processes` for its diagnosis. Raises InputError."""
    if settings.repairs is not None and (settings.as_recorded or settings.preset == "documented"):
        why = "--as-recorded" if settings.as_recorded else "the documented preset"
        raise InputError(f"repairs: {why} uses no repairs; leave out one of the two")
    if len(sequence.observations) and (reason := unusable(sequence)):
        raise InputError(f"{sequence.source}: features: {reason}")
    if sequence.imu is None and (settings.as_recorded or settings.preset == "documented"):
        _require_units(sequence)
    repairs = None if settings.repairs is None else read_repairs(settings.repairs)
    features = None if settings.features == "all" else settings.features
    if settings.preset == "documented":
        if settings.features is None:
            features = DEFAULT_FEATURES
        return documented(sequence, features, settings.landmarks)
    assumed = Calibration() if settings.as_recorded else None
    return calibrated(sequence, features, settings=assumed, repairs=repairs, processes=processes)


def preliminary_remarks(problem: Problem) -> list[str]:
    """Sentences that a run prints first: faults of the file, and ground truth for few frames."""
    sentences = [finding.sentence for finding in problem.findings if finding.code in OF_THE_FILE]
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
