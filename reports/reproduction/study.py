"""Everything that is measured on one recording: the report's own runs, the same without each cause, and the sweep."""

from collections.abc import Iterator
from dataclasses import dataclass

from fgbaseline import ekf
from fgbaseline.data import Estimate, LandmarkMode, Progress, Sequence
from fgbaseline.data.motion import dead_reckoned_path, increments
from fgbaseline.data.problem.documented import SLAM_PIXEL_VARIANCE
from fgbaseline.diagnosis import Diagnosis, diagnose
from fgbaseline.geometry import FloatArray

from .recordings import MAPPED, Subject
from .stages import Stage, diagnosed_stages, simulated_stages
from .trial import Outcome, Settings, judged, pose, run

LOW_PIXEL_VARIANCE = 0.01
LOW_MOTION = 1e-6
"""times W"""


@dataclass(frozen=True, slots=True)
class SweepSettings:
    """What is swept."""

    features: tuple[int, ...] = (200, 400, 700, 1000)
    pixel_variances: tuple[float, ...] = (0.01, 1.0, SLAM_PIXEL_VARIANCE, 100.0)
    """V, px^2"""


@dataclass(frozen=True, eq=False, slots=True)
class Mapped:
    """Landmark mapping, part (b) of the report."""

    estimate: Estimate
    before: Outcome
    """with the landmarks where they start"""
    after: Outcome


@dataclass(frozen=True, eq=False, slots=True)
class Staged:
    """The filter of figure 9 on a stage of the repair."""

    stage: Stage
    outcome: Outcome
    path: FloatArray
    """(T, 4, 4)"""
    predicted: FloatArray
    """(T, 4, 4) dead reckoning"""


@dataclass(frozen=True, eq=False, slots=True)
class Study:
    """What was found on one recording."""

    subject: Subject
    predicted: FloatArray
    """(T, 4, 4) dead reckoning of the recording itself"""
    diagnosis: Diagnosis | None
    """None where the faults are known, having been simulated"""
    mapped: dict[int, Mapped]
    """by number of features"""
    slam: Estimate
    """of figure 9"""
    staged: list[Staged]
    low: dict[str, Outcome]
    """with low noise: `pixels`, `motion` and, as low as can be, `none`"""
    held: list[Outcome]
    """with landmarks held at the mapping's, the other reading, over numbers of features (the last all) and noise"""
    swept: list[Outcome]
    swept_repaired: list[Outcome]

    @property
    def recorded(self) -> Outcome:
        """The filter of figure 9 on the recording as it is."""
        return self.staged[0].outcome

    @property
    def repaired(self) -> Outcome:
        """The same on the repaired recording."""
        return self.staged[-1].outcome

    @property
    def causes(self) -> list[str]:
        """What was wrong, in the order of the repair."""
        return [staged.stage.cause for staged in self.staged[1:]]


def stages_of(subject: Subject) -> tuple[Diagnosis | None, list[Stage]]:
    """What is wrong with a recording, and the recording without it."""
    if subject.stand_in is not None:
        return None, simulated_stages(subject.stand_in)
    diagnosis = diagnose(subject.recorded)
    return diagnosis, diagnosed_stages(diagnosis)


def study(
    subject: Subject,
    sweep: SweepSettings,
    found: tuple[Diagnosis | None, list[Stage]],
    progress: Progress,
) -> Study:
    """Runs the documented filter on a recording with every setting that the report names."""
    diagnosis, stages = found
    sequence, last = subject.studied, stages[-1].sequence
    grid = [Settings(n, v) for v in sweep.pixel_variances for n in sweep.features]
    held = [
        Settings(n, v, reading=LandmarkMode.FIXED) for v in sweep.pixel_variances for n in (max(sweep.features), None)
    ]
    low = {
        "pixels": Settings(pixel_variance=LOW_PIXEL_VARIANCE),
        "motion": Settings(motion=LOW_MOTION),
        "none": Settings(motion=0.0),
    }
    repaired = grid if len(stages) > 1 else []
    runs = len(MAPPED) + len(stages) + len(low) + len(held) + len(grid) + len(repaired)
    tick = _ticks(runs, sequence.n_frames, progress)
    mapped = {n: _mapped(sequence, n, tick) for n in MAPPED}
    staged, paths = [], []
    for stage in stages:
        outcome, estimate = run(stage.sequence, Settings())
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
    settings = Settings(features)
    problem = pose(sequence, settings)
    before, estimate = ekf.dead_reckoning(problem), ekf.landmark_mapping(problem)
    next(tick)
    return Mapped(estimate, judged(problem, settings, before), judged(problem, settings, estimate))


def _one(sequence: Sequence, settings: Settings, tick: Iterator[None]) -> Outcome:
    outcome, _ = run(sequence, settings)
    next(tick)
    return outcome


def _ticks(runs: int, frames: int, progress: Progress) -> Iterator[None]:
    """Reports one more run over all frames at each step."""
    for done in range(1, runs + 1):
        progress(done * frames, runs * frames)
        yield
