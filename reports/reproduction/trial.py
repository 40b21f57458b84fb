"""One run of the documented filter, and the figures by which it is judged."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from fgbaseline import compare, ekf
from fgbaseline.data import Estimate, LandmarkMode, Problem, Sequence, Status, documented
from fgbaseline.data.motion import dead_reckoned_path
from fgbaseline.data.problem.documented import DEFAULT_FEATURES, SLAM_PIXEL_VARIANCE
from fgbaseline.geometry import FloatArray, se3


@dataclass(frozen=True, slots=True)
class Settings:
    """Of the documented filter; the defaults are those of the report's figure 9."""

    features: int | None = DEFAULT_FEATURES
    """None for all"""
    pixel_variance: float = SLAM_PIXEL_VARIANCE
    """V, px^2"""
    motion: float = 1.0
    """times the report's W"""
    reading: LandmarkMode = LandmarkMode.UPDATED


@dataclass(frozen=True, slots=True)
class Outcome:
    """Figures of a run. NaN where the filter gave no path."""

    settings: Settings
    features: int
    """landmarks that took part"""
    status: Status
    reason: str
    lost: int
    """frames at which (I - K H) Sigma as printed is no covariance any more"""
    first_lost: int | None
    apart_rmse: float
    """m, distance from dead reckoning of the same recording"""
    apart_max: float
    apart_final: float
    correction_m: float
    """RMS of what an update adds to a frame's motion"""
    correction_deg: float
    reprojection: float
    """px, median over all observations of the chosen features"""
    behind: float
    """share of these whose landmark ends up behind the camera that saw it"""
    height: float
    """m above the start at the end"""
    truth_rmse: float
    """m, distance from the truth, where the recording has one"""

    @property
    def breaks(self) -> bool:
        """Whether the printed equations fail: no path, or a covariance lost on the way."""
        return self.lost > 0 or self.status is Status.FAILED

    def record(self) -> dict[str, object]:
        """The figures as claims.json has them, what is not a number as None."""
        every = asdict(self)
        every |= every.pop("settings") | {"landmarks": self.features}
        return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in every.items()}


def pose(sequence: Sequence, settings: Settings) -> Problem:
    """The report's problem with this noise."""
    problem = documented(sequence, settings.features, settings.reading)
    return replace(
        problem,
        pixel_variance=settings.pixel_variance,
        increment_covariance=problem.increment_covariance * settings.motion,
    )


def run(sequence: Sequence, settings: Settings) -> tuple[Outcome, Estimate]:
    """The documented filter on a recording, and what came of it."""
    problem = pose(sequence, settings)
    estimate = ekf.ekf(problem)
    return judged(problem, settings, estimate), estimate


def judged(problem: Problem, settings: Settings, estimate: Estimate) -> Outcome:
    """The figures of an answer."""
    predicted = dead_reckoned_path(problem.increment, problem.initial_pose)
    apart = np.linalg.norm(estimate.world_T_imu[:, :3, 3] - predicted[:, :3, 3], axis=1)
    table = compare.reprojection(problem.sequence, estimate)
    pixels = compare.reprojection_summary(table)
    complete = estimate.status is not Status.FAILED
    correction = _corrections(estimate.world_T_imu, predicted) if complete else np.full((1, 6), np.nan)
    return Outcome(
        settings=settings,
        features=len(problem.features),
        status=estimate.status,
        reason=estimate.reason,
        lost=len(estimate.events),
        first_lost=estimate.events[0].frame if estimate.events else None,
        apart_rmse=_rms(apart) if complete else np.nan,
        apart_max=float(apart.max()) if complete else np.nan,
        apart_final=float(apart[-1]),
        correction_m=_rms(np.linalg.norm(correction[:, :3], axis=1)),
        correction_deg=float(np.rad2deg(_rms(np.linalg.norm(correction[:, 3:], axis=1)))),
        reprojection=float(pixels["median"]) if complete else np.nan,
        behind=float(pixels["behind_camera"]) / max(1, len(table)) if complete else np.nan,
        height=float(estimate.world_T_imu[-1, :3, 3] @ problem.sequence.up),
        truth_rmse=_from_truth(problem.sequence, estimate.world_T_imu) if complete else np.nan,
    )


def path_length(path: FloatArray) -> float:
    """Length of a path (T, 4, 4), m."""
    return float(np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1).sum())


def _corrections(path: FloatArray, predicted: FloatArray) -> FloatArray:
    """(T-1, 6) from each predicted motion to the one that the filter ends up with."""
    return se3.log(se3.inverse(se3.relative(predicted)) @ se3.relative(path))


def _from_truth(sequence: Sequence, path: FloatArray) -> float:
    if sequence.truth is None:
        return np.nan
    apart = np.linalg.norm(path[:, :3, 3] - sequence.truth.world_T_imu[:, :3, 3], axis=1)
    return _rms(apart[np.isfinite(apart)])


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan
