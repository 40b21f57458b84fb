"""Runs of the documented filter on a recording: the source paper's, those after each repair, and the sweep."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np

from fgbaseline import compare, ekf
from fgbaseline.compare import summarized
from fgbaseline.data import Estimate, LandmarkMode, Problem, Progress, Sequence, Status, documented
from fgbaseline.data.problem.documented import DEFAULT_FEATURES, SLAM_PIXEL_VARIANCE
from fgbaseline.data.velocity_increments import dead_reckoned_path, increments
from fgbaseline.diagnosis import Diagnosis, diagnose
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.geometry.path_length import path_length

from .recordings import MAPPED, Stage, Subject, diagnosed_stages, simulated_stages

LOW_PIXEL_VARIANCE = 0.01
LOW_MOTION = 1e-6
"""factor on W"""


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """Settings of the documented filter; the defaults are those of the source paper's figure 9."""

    features: int | None = DEFAULT_FEATURES
    """None for all"""
    pixel_variance: float = SLAM_PIXEL_VARIANCE
    """V, px^2"""
    motion: float = 1.0
    """factor on the source paper's W"""
    reading: LandmarkMode = LandmarkMode.UPDATED


@dataclass(frozen=True, slots=True)
class Outcome:
    """Metrics of a run of the filter; NaN where it gave no path."""

    settings: FilterSettings
    features: int
    """number of landmarks"""
    status: Status
    reason: str
    lost: int
    """number of frames where (I - K H) Sigma, as printed, is not positive definite"""
    first_lost: int | None
    apart_rmse: float
    """m, distance from dead reckoning of the same recording"""
    apart_max: float
    apart_final: float
    correction_m: float
    """RMS of the change of a frame's motion by an update"""
    correction_deg: float
    reprojection: float
    """px, median over all observations of the chosen features"""
    behind: float
    """share of the observations whose landmark is behind the camera after the last frame"""
    height: float
    """m, of the end above the start"""
    truth_rmse: float
    """m, distance from the truth, where the recording has one"""

    @property
    def breaks(self) -> bool:
        """Whether the printed equations fail: no path, or a covariance that is not positive definite."""
        return self.lost > 0 or self.status is Status.FAILED

    def record(self) -> dict[str, object]:
        """The metrics for claims.json, None for NaN and infinity."""
        every = asdict(self)
        every |= every.pop("settings") | {"landmarks": self.features}
        return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in every.items()}


@dataclass(frozen=True, slots=True)
class SweepSettings:
    """Settings of the sweep."""

    features: tuple[int, ...] = (200, 400, 700, 1000)
    pixel_variances: tuple[float, ...] = (0.01, 1.0, SLAM_PIXEL_VARIANCE, 100.0)
    """V, px^2"""


@dataclass(frozen=True, eq=False, slots=True)
class Mapped:
    """Landmark mapping, part (b) of the source paper."""

    estimate: Estimate
    before: Outcome
    """with the initial landmarks"""
    after: Outcome


@dataclass(frozen=True, eq=False, slots=True)
class Staged:
    """The filter of figure 9 at a stage of the repair."""

    stage: Stage
    outcome: Outcome
    path: FloatArray
    """(T, 4, 4)"""
    predicted: FloatArray
    """(T, 4, 4) dead reckoning"""


@dataclass(frozen=True, eq=False, slots=True)
class Study:
    """Results on one recording."""

    subject: Subject
    predicted: FloatArray
    """(T, 4, 4) dead reckoning of the recording itself"""
    diagnosis: Diagnosis | None
    """None for simulated faults, which are known"""
    mapped: dict[int, Mapped]
    """by number of features"""
    slam: Estimate
    """SLAM of figure 9"""
    staged: list[Staged]
    low: dict[str, Outcome]
    """with low noise: `pixels`, `motion`, and `none` for zero motion noise"""
    held: list[Outcome]
    """with landmarks fixed at those of the mapping, over numbers of features (all, last) and noise"""
    swept: list[Outcome]
    swept_repaired: list[Outcome]

    @property
    def road(self) -> float:
        """Length of the dead-reckoned path, m."""
        return path_length(self.predicted[:, :3, 3])

    @property
    def recorded(self) -> Outcome:
        """The filter of figure 9 on the recording as recorded."""
        return self.staged[0].outcome

    @property
    def repaired(self) -> Outcome:
        """The filter of figure 9 on the repaired recording."""
        return self.staged[-1].outcome

    @property
    def causes(self) -> list[str]:
        """The faults, in the order of their repair."""
        return [staged.stage.cause for staged in self.staged[1:]]


def stages_of(subject: Subject) -> tuple[Diagnosis | None, list[Stage]]:
    """Diagnoses a recording, and repairs it one fault at a time."""
    if subject.stand_in is not None:
        return None, simulated_stages(subject.stand_in)
    diagnosis = diagnose(subject.recorded)
    return diagnosis, diagnosed_stages(diagnosis)


def study_recording(
    subject: Subject, sweep: SweepSettings, found: tuple[Diagnosis | None, list[Stage]], progress: Progress
) -> Study:
    """Runs the documented filter on a recording with all settings of the source paper."""
    diagnosis, stages = found
    sequence, last = subject.studied, stages[-1].sequence
    grid = [FilterSettings(n, v) for v in sweep.pixel_variances for n in sweep.features]
    held = [
        FilterSettings(n, v, reading=LandmarkMode.FIXED)
        for v in sweep.pixel_variances
        for n in (max(sweep.features), None)
    ]
    low = {
        "pixels": FilterSettings(pixel_variance=LOW_PIXEL_VARIANCE),
        "motion": FilterSettings(motion=LOW_MOTION),
        "none": FilterSettings(motion=0.0),
    }
    repaired = grid if len(stages) > 1 else []
    runs = len(MAPPED) + len(stages) + len(low) + len(held) + len(grid) + len(repaired)
    tick = _ticks(runs, sequence.n_frames, progress)
    mapped = {n: _mapped(sequence, n, tick) for n in MAPPED}
    staged, paths = [], []
    for stage in stages:
        outcome, estimate = run_filter(stage.sequence, FilterSettings())
        predicted = dead_reckoned_path(increments(stage.sequence))
        staged.append(Staged(stage, outcome, estimate.world_T_imu, predicted))
        paths.append(estimate)
        next(tick)
    return Study(
        subject=subject,
        predicted=dead_reckoned_path(increments(subject.recorded)),
        diagnosis=diagnosis,
        mapped=mapped,
        slam=paths[0],
        staged=staged,
        low={name: _one(sequence, settings, tick) for name, settings in low.items()},
        held=[_one(sequence, settings, tick) for settings in held],
        swept=[_one(sequence, settings, tick) for settings in grid],
        swept_repaired=[_one(last, settings, tick) for settings in repaired],
    )


def _mapped(sequence: Sequence, features: int, tick: Iterator[None]) -> Mapped:
    settings = FilterSettings(features)
    problem = build_problem(sequence, settings)
    before, estimate = ekf.dead_reckoning(problem), ekf.landmark_mapping(problem)
    next(tick)
    return Mapped(estimate, evaluate(problem, settings, before), evaluate(problem, settings, estimate))


def _one(sequence: Sequence, settings: FilterSettings, tick: Iterator[None]) -> Outcome:
    outcome, _ = run_filter(sequence, settings)
    next(tick)
    return outcome


def _ticks(runs: int, frames: int, progress: Progress) -> Iterator[None]:
    """Reports one more finished run over all frames at each step."""
    for done in range(1, runs + 1):
        progress(done * frames, runs * frames)
        yield


def build_problem(sequence: Sequence, settings: FilterSettings) -> Problem:
    """Builds the source paper's problem with these settings."""
    problem = documented(sequence, settings.features, settings.reading)
    return replace(
        problem,
        pixel_variance=settings.pixel_variance,
        increment_covariance=problem.increment_covariance * settings.motion,
    )


def run_filter(sequence: Sequence, settings: FilterSettings) -> tuple[Outcome, Estimate]:
    """Runs the documented filter on a recording."""
    problem = build_problem(sequence, settings)
    estimate = ekf.ekf(problem)
    return evaluate(problem, settings, estimate), estimate


def evaluate(problem: Problem, settings: FilterSettings, estimate: Estimate) -> Outcome:
    """Computes the metrics of an estimate."""
    path, predicted = estimate.world_T_imu, dead_reckoned_path(problem.increment, problem.initial_pose)
    apart, truth = _apart(path, predicted), problem.sequence.truth
    table = compare.reprojection(problem.sequence, estimate)
    pixels = compare.reprojection_summary(table)
    complete = estimate.status is not Status.FAILED
    correction = np.full((1, 6), np.nan)  # (T-1, 6), [v, w], from each predicted motion to the estimated one
    if complete:
        correction = se3.log(se3.inverse(se3.relative(predicted)) @ se3.relative(path))
    return Outcome(
        settings=settings,
        features=len(problem.features),
        status=estimate.status,
        reason=estimate.reason,
        lost=len(estimate.events),
        first_lost=estimate.events[0].frame if estimate.events else None,
        apart_rmse=summarized(apart)["rmse"] if complete else np.nan,
        apart_max=float(apart.max()) if complete else np.nan,
        apart_final=float(apart[-1]),
        correction_m=summarized(np.linalg.norm(correction[:, :3], axis=1))["rmse"],
        correction_deg=float(np.rad2deg(summarized(np.linalg.norm(correction[:, 3:], axis=1))["rmse"])),
        reprojection=float(pixels["median"]) if complete else np.nan,
        behind=float(pixels["behind_camera"]) / max(1, len(table)) if complete else np.nan,
        height=float(path[-1, :3, 3] @ problem.sequence.up),
        truth_rmse=np.nan if truth is None or not complete else summarized(_apart(path, truth.world_T_imu))["rmse"],
    )


def _apart(path: FloatArray, other: FloatArray) -> FloatArray:
    """Distances (T,), m, of poses (T, 4, 4)."""
    return np.asarray(np.linalg.norm(path[:, :3, 3] - other[:, :3, 3], axis=1))
