"""Is the reference to be trusted? From its own evidence, never from truth."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from fgbaseline.data import Estimate, EventKind, Excluded, Problem, Status
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import disparity

from .residuals.cost import cost
from .residuals.noise_scale import motion_scale, pixel_scale

FAR_POINT = 1.0
"""px of disparity"""
NOTABLE = 0.05
"""share of impossible observations from which on it is reported"""


class Verdict(IntEnum):
    """How far a reference can be leaned on; the worst finding decides."""

    TRUSTED = 0
    DOUBTFUL = 1
    UNTRUSTED = 2


@dataclass(frozen=True, slots=True)
class Trust:
    """A verdict and the sentences it rests on, worst first."""

    verdict: Verdict
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TrustLimits:
    """Where a finding turns doubtful, and where untrusted."""

    pixel_scale: tuple[float, float] = (1.6, 3.0)
    """pixel noise that explains the residuals over that of the model: see `pixel_scale`"""
    motion_scale: tuple[float, float] = (1.4, 2.4)
    """the same of the motion increments: see `motion_scale`"""
    used_share: tuple[float, float] = (0.6, 0.3)
    """of the `offered` observations"""
    weak_frames: tuple[float, float] = (0.05, 0.25)
    """share of frames with fewer than `weak_below` used observations"""
    weak_below: int = 6
    untied_intervals: tuple[float, float] = (0.25, 0.6)
    """share of the intervals that no used landmark is seen on both sides of"""
    given_up_frames: tuple[float, float] = (0.0, 0.05)
    """share of frames whose observations had to be given up"""
    batch_cost: tuple[float, float] = (0.005, 0.05)
    """share by which its cost is above that of the batch solution"""
    batch_position: tuple[float, float] = (0.1, 2.0)
    """baselines of the rig, RMSE of its positions from those of the batch solution"""
    impossible_share: tuple[float, float] = (0.2, 0.5)
    """of the `offered` observations: those without a positive disparity"""


def trust(
    problem: Problem, reference: Estimate, batch: Estimate | None = None, limits: TrustLimits | None = None
) -> Trust:
    """The verdict on an estimate, from whitened residuals, the share of observations used, weak frames and `batch`.

    Residuals are held against the problem's own noise model: see `pixel_scale` and `motion_scale`.
    """
    if reference.status is Status.FAILED:
        return Trust(Verdict.UNTRUSTED, (f"it failed: {reference.reason}",))
    limit = limits or TrustLimits()
    n_used = int(reference.used.sum())
    if n_used == 0:
        return Trust(Verdict.UNTRUSTED, ("it used no observation",))
    pixel, motion = pixel_scale(problem, reference), motion_scale(problem, reference)
    counted = offered(problem)
    n_offered = max(1, int(counted.sum()))
    share = int((reference.used & counted).sum()) / n_offered
    impossible = int((counted & ~possible(problem)).sum()) / n_offered
    per_frame = np.bincount(problem.sequence.observations.frame[reference.used], minlength=problem.n_frames)
    weak = float(np.mean(per_frame < limit.weak_below))
    lost = {event.frame for event in reference.events if event.kind == EventKind.FRAME_WITHOUT_OBSERVATIONS}
    given_up = len(lost) / problem.n_frames
    robust = "" if problem.kernel is None else ", robust"
    findings = [
        (_above(pixel, limit.pixel_scale), f"normalized pixel residual RMS {_figure(pixel)} (expected 1{robust})"),
        (_above(motion, limit.motion_scale), f"normalized motion residual RMS {_figure(motion)} (expected at most 1)"),
        (_below(share, limit.used_share), f"it used {share:.0%} of the observations, far points aside"),
        (_above(weak, limit.weak_frames), f"{weak:.1%} of the frames have fewer than {limit.weak_below} observations"),
        (_above(given_up, limit.given_up_frames), f"the observations of {given_up:.1%} of the frames were given up"),
    ]
    untied = int((problem.sequence.observations.select(reference.used).ties(problem.n_frames) == 0).sum())
    if impossible > NOTABLE:
        text = f"{impossible:.0%} of the observations have no positive disparity, which no point in view can have"
        findings.append((_above(impossible, limit.impossible_share), text))
    if untied:
        share = untied / (problem.n_frames - 1)
        text = (
            f"over {untied:,} of {problem.n_frames - 1:,} intervals no landmark ties what lies on both sides: only the "
            "velocities tell the motion there, and a jump would not show"
        )
        findings.append((_above(share, limit.untied_intervals), text))
    if not problem.diagnosed:
        findings.append((Verdict.TRUSTED, "the recording was not diagnosed: its noise is assumed"))
    findings.append(_beside_batch(problem, reference, batch, limit))
    findings.sort(key=lambda finding: -finding[0])
    return Trust(max(verdict for verdict, _ in findings), tuple(text for _, text in findings))


def offered(problem: Problem) -> BoolArray:
    """(n,) the observations that an estimator is expected to use: all of the problem, and those of the wanted features
    that it excludes, but for far points: a disparity above 0 and of at most 1 px is possible and says little of the
    depth. What is impossible (no positive disparity) is counted."""
    d = disparity(problem.sequence.observations.pixel)
    wanted = problem.excluded != Excluded.FEATURE_NOT_CHOSEN
    return np.asarray(problem.mask | (wanted & ~((d > 0.0) & (d <= FAR_POINT))), dtype=np.bool_)


def possible(problem: Problem) -> BoolArray:
    """(n,) whether an observation has a positive disparity, as every point in front of the cameras has."""
    return np.asarray(disparity(problem.sequence.observations.pixel) > 0.0, dtype=np.bool_)


def _beside_batch(
    problem: Problem, reference: Estimate, batch: Estimate | None, limit: TrustLimits
) -> tuple[Verdict, str]:
    """Has the reference found the minimum? Costs are compared over the observations that both used."""
    if batch is None or batch.status is Status.FAILED:
        why = "" if batch is None else f": that failed, {batch.reason}"
        return Verdict.TRUSTED, f"not compared with a batch solution{why}"
    if any(event.kind == EventKind.ONE_START for event in batch.events):
        return (
            Verdict.DOUBTFUL,
            "a batch solution was found from one start only: nothing says that it is the lowest",
        )
    if batch is reference:
        return Verdict.TRUSTED, "it is the batch solution itself"
    both = reference.used & batch.used
    excess = cost(problem, reference, both) / cost(problem, batch, both) - 1.0
    apart = reference.world_T_imu[:, :3, 3] - batch.world_T_imu[:, :3, 3]
    rmse = float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))
    baselines = rmse / problem.sequence.camera.baseline
    verdict = max(_above(excess, limit.batch_cost), _above(baselines, limit.batch_position))
    said = "a batch solution agrees" if verdict is Verdict.TRUSTED else "a batch solution disagrees"
    return verdict, f"{said}: the cost is {excess:+.2g} of it away and the path {rmse:.2g} m (RMSE)"


def _above(value: float, limits: tuple[float, float]) -> Verdict:
    return Verdict(int(not value <= limits[0]) + int(not value <= limits[1]))


def _below(value: float, limits: tuple[float, float]) -> Verdict:
    return Verdict(int(not value >= limits[0]) + int(not value >= limits[1]))


def _figure(value: float) -> str:
    return f"{value:.2g}"
