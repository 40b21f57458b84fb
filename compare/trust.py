"""Is the reference to be trusted? From its own evidence, never from truth."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from fgbaseline.data import Estimate, EventKind, Excluded, Problem, Status
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import disparity

from .cost import cost, motion_squares, pixel_squares
from .reprojection import ROWS, reprojection


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

    pixel_ratio: tuple[float, float] = (2.0, 4.0)
    """mean whitened squared residual of an observation over its expectation"""
    motion_ratio: tuple[float, float] = (2.0, 6.0)
    """the same of the motion increments"""
    used_share: tuple[float, float] = (0.6, 0.3)
    """of the observations with a usable disparity"""
    weak_frames: tuple[float, float] = (0.05, 0.25)
    """share of frames with fewer than `weak_below` used observations"""
    weak_below: int = 6
    untied_intervals: tuple[float, float] = (0.25, 0.6)
    """share of the intervals that no used landmark is seen on both sides of"""
    given_up_frames: tuple[float, float] = (0.0, 0.05)
    """share of frames whose observations had to be given up"""
    batch_cost: tuple[float, float] = (0.005, 0.05)
    """share by which its cost is above that of the batch solution"""
    batch_position: tuple[float, float] = (0.05, 1.0)
    """m, RMSE of its positions from those of the batch solution"""


def trust(
    problem: Problem, reference: Estimate, batch: Estimate | None = None, limits: TrustLimits | None = None
) -> Trust:
    """The verdict on an estimate, from whitened residuals, the share of observations used, weak frames and `batch`.

    Under the problem's own noise model a whitened squared residual of three rows is 3 on average, less the share that
    the estimated landmarks absorb, and one of an increment at most 6. Kernel-weighted, so that the residuals are those
    the optimum saw.
    """
    if reference.status is Status.FAILED:
        return Trust(Verdict.UNTRUSTED, (f"it failed: {reference.reason}",))
    limit = limits or TrustLimits()
    n_used = int(reference.used.sum())
    if n_used == 0:
        return Trust(Verdict.UNTRUSTED, ("it used no observation",))
    pixel, motion = pixel_ratio(problem, reference), motion_ratio(problem, reference)
    share = n_used / max(1, int(offered(problem).sum()))
    per_frame = np.bincount(problem.sequence.observations.frame[reference.used], minlength=problem.n_frames)
    weak = float(np.mean(per_frame < limit.weak_below))
    lost = {event.frame for event in reference.events if event.kind == EventKind.FRAME_WITHOUT_OBSERVATIONS}
    given_up = len(lost) / problem.n_frames
    model = "as large as the noise model says"
    findings = [
        (_above(pixel, limit.pixel_ratio), f"its pixel residuals are {_times(pixel)} {model}"),
        (_above(motion, limit.motion_ratio), f"its departures from the measured motion are {_times(motion)} {model}"),
        (_below(share, limit.used_share), f"it used {share:.0%} of the observations with a disparity above 1 px"),
        (_above(weak, limit.weak_frames), f"{weak:.1%} of the frames have fewer than {limit.weak_below} observations"),
        (_above(given_up, limit.given_up_frames), f"the observations of {given_up:.1%} of the frames were given up"),
    ]
    untied = int((problem.sequence.observations.select(reference.used).ties(problem.n_frames) == 0).sum())
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
    """(n,) the observations a problem could have used: of the wanted features, with a disparity above 1 px."""
    usable = disparity(problem.sequence.observations.pixel) > 1.0
    return np.asarray(usable & (problem.excluded != Excluded.FEATURE_NOT_CHOSEN), dtype=np.bool_)


def pixel_ratio(problem: Problem, estimate: Estimate) -> float:
    """Mean over the used observations of the whitened, kernel-weighted squared residual, over its expectation.

    Expected are 3 (n - m) / n for n observations of m landmarks without a prior, and 3 with one.
    """
    table = reprojection(problem.sequence, estimate)
    squared = pixel_squares(problem, table.loc[table["used"], list(ROWS)].to_numpy())
    if problem.kernel is not None:
        norm = np.sqrt(np.maximum(squared, problem.kernel.threshold**2))
        squared = squared * problem.kernel.threshold / norm
    n = len(squared)
    absorbed = 0 if problem.landmark_prior is not None else len(estimate.landmarks)
    return float(squared.sum() / max(1.0, 3.0 * (n - absorbed)))


def motion_ratio(problem: Problem, estimate: Estimate) -> float:
    """Mean over the increments of the whitened squared residual of the estimated motion, over 6."""
    return float(np.mean(motion_squares(problem, estimate)) / 6.0)


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
    verdict = max(_above(excess, limit.batch_cost), _above(rmse, limit.batch_position))
    said = "a batch solution agrees" if verdict is Verdict.TRUSTED else "a batch solution disagrees"
    return verdict, f"{said}: the cost is {excess:+.2g} of it away and the path {rmse:.2g} m (RMSE)"


def _above(value: float, limits: tuple[float, float]) -> Verdict:
    return Verdict(int(not value <= limits[0]) + int(not value <= limits[1]))


def _below(value: float, limits: tuple[float, float]) -> Verdict:
    return Verdict(int(not value >= limits[0]) + int(not value >= limits[1]))


def _times(variance_ratio: float) -> str:
    return f"{np.sqrt(variance_ratio):.2g} times"
