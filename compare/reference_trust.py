"""Trust in the reference: a verdict from its residuals and its agreement with a batch solution, never from truth."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from fgbaseline.data import Estimate, EventKind, Excluded, Problem, Status
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.plural import percent
from fgbaseline.geometry import disparity

from .residuals.cost import cost
from .residuals.noise_scale import motion_scale, pixel_scale
from .statistics.descriptive import rms_norm

FAR_POINT = 1.0
"""px; disparity up to which a point is far"""
NOTABLE = 0.05
"""share of observations without positive disparity above which it is reported"""


class Verdict(IntEnum):
    """Trust in a reference; the worst finding decides."""

    TRUSTED = 0
    DOUBTFUL = 1
    UNTRUSTED = 2


@dataclass(frozen=True, slots=True)
class Trust:
    """Verdict and its reasons in sentences, worst first."""

    verdict: Verdict
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TrustLimits:
    """Limits of each finding: doubtful, untrusted."""

    pixel_scale: tuple[float, float] = (1.6, 3.0)
    """estimated over modeled sigma of the pixel noise: see `pixel_scale`"""
    motion_scale: tuple[float, float] = (1.4, 2.4)
    """estimated over modeled sigma of the motion increments: see `motion_scale`"""
    used_share: tuple[float, float] = (0.6, 0.3)
    """share of the `expected_observations` that were used"""
    weak_frames: tuple[float, float] = (0.05, 0.25)
    """share of frames with fewer than `weak_below` used observations"""
    weak_below: int = 6
    untied_intervals: tuple[float, float] = (0.25, 0.6)
    """share of the intervals between frames across which no used landmark is tracked"""
    given_up_frames: tuple[float, float] = (0.0, 0.05)
    """share of frames whose observations were dropped"""
    batch_cost: tuple[float, float] = (0.005, 0.05)
    """relative excess of its cost over that of the batch solution"""
    batch_position: tuple[float, float] = (0.1, 2.0)
    """RMSE of its positions from those of the batch solution, in baselines of the stereo rig"""
    impossible_share: tuple[float, float] = (0.2, 0.5)
    """share of the `expected_observations` without positive disparity"""


def trust(
    problem: Problem, reference: Estimate, batch: Estimate | None = None, limits: TrustLimits | None = None
) -> Trust:
    """Verdict on a reference from its whitened residuals, share of observations used, weak frames and `batch`.

    Residuals are compared with the problem's own noise model: see `pixel_scale` and `motion_scale`.
    """
    if reference.status is Status.FAILED:
        return Trust(Verdict.UNTRUSTED, (f"it failed: {reference.reason}",))
    limit = limits or TrustLimits()
    n_used = int(reference.used.sum())
    if n_used == 0:
        return Trust(Verdict.UNTRUSTED, ("it used no observation",))
    pixel, motion = pixel_scale(problem, reference), motion_scale(problem, reference)
    counted = expected_observations(problem)
    n_offered = max(1, int(counted.sum()))
    share = int((reference.used & counted).sum()) / n_offered
    impossible = int((counted & ~has_positive_disparity(problem)).sum()) / n_offered
    per_frame = np.bincount(problem.sequence.observations.frame[reference.used], minlength=problem.n_frames)
    weak = float(np.mean(per_frame < limit.weak_below))
    lost = {event.frame for event in reference.events if event.kind == EventKind.FRAME_WITHOUT_OBSERVATIONS}
    given_up = len(lost) / problem.n_frames
    robust = "" if problem.kernel is None else ", robust"
    findings = [
        (_above(pixel, limit.pixel_scale), f"normalized pixel residual RMS {_figure(pixel)} (expected 1{robust})"),
        (_above(motion, limit.motion_scale), f"normalized motion residual RMS {_figure(motion)} (expected at most 1)"),
        (_below(share, limit.used_share), f"it used {percent(share)} of the observations, far points aside"),
        (
            _above(weak, limit.weak_frames),
            f"{percent(weak, 1)} of the frames have fewer than {limit.weak_below} observations",
        ),
        (
            _above(given_up, limit.given_up_frames),
            f"the observations of {percent(given_up, 1)} of the frames were given up",
        ),
    ]
    untied = int((problem.sequence.observations.select(reference.used).ties(problem.n_frames) == 0).sum())
    if impossible > NOTABLE:
        text = f"{percent(impossible)} of the observations have no positive disparity, which no point in view can have"
        findings.append((_above(impossible, limit.impossible_share), text))
    if untied:
        share = untied / (problem.n_frames - 1)
        text = (
            f"over {untied:,} of {problem.n_frames - 1:,} intervals no landmark ties what lies on both sides: only the "
            "velocities give the motion there, and a jump would not show"
        )
        findings.append((_above(share, limit.untied_intervals), text))
    if not problem.diagnosed:
        findings.append((Verdict.TRUSTED, "the recording was not diagnosed: its noise is assumed"))
    findings.append(_beside_batch(problem, reference, batch, limit))
    findings.sort(key=lambda finding: -finding[0])
    return Trust(max(verdict for verdict, _ in findings), tuple(text for _, text in findings))


def expected_observations(problem: Problem) -> BoolArray:
    """Observations (n,) that an estimator should use: those of the problem, and excluded ones of chosen features.

    Excluded far points (disparity above 0, at most FAR_POINT) do not count, as they determine no depth. Observations
    without positive disparity, which are impossible, do count.
    """
    d = disparity(problem.sequence.observations.pixel)
    wanted = problem.excluded != Excluded.FEATURE_NOT_CHOSEN
    return np.asarray(problem.mask | (wanted & ~((d > 0.0) & (d <= FAR_POINT))), dtype=np.bool_)


def has_positive_disparity(problem: Problem) -> BoolArray:
    """Whether an observation (n,) has a positive disparity, as every point in front of the cameras has."""
    return np.asarray(disparity(problem.sequence.observations.pixel) > 0.0, dtype=np.bool_)


def _beside_batch(
    problem: Problem, reference: Estimate, batch: Estimate | None, limit: TrustLimits
) -> tuple[Verdict, str]:
    """Whether the reference is at the minimum of the cost, over the observations that both used."""
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
    rmse = rms_norm(apart)
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
