"""Trust in the reference: a verdict by its residuals, its data and its agreement with a batch solution.

Ground truth is never used.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from fgbaseline.data import Estimate, EventKind, Problem, Status
from fgbaseline.data.display import Displayed
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.wording import distance, limit_per_cent, number, per_cent, plural
from fgbaseline.geometry import disparity
from fgbaseline.geometry.monocular_camera import UNIT_LENGTH

from .residuals.cost import cost
from .residuals.noise_scale import motion_scale, pixel_scale
from .statistics.descriptive import rms_norm

FAR_POINT = 1.0
"""px; disparity up to which a point is far"""
FAR_REMARK = f"far: disparity of 0 to {FAR_POINT:g} px, masked"
RESOLUTION = 1e-5
"""smallest reported difference from the batch solution: position RMSE in m, cost as a relative difference"""
NOTABLE_INFLATION = 1.1
"""inflation of the pixel sigma from which on it is reported"""
NOTABLE = 0.05
"""share of observations without positive disparity above which the share is a reason"""
SHARE = "share"
"""unit of a part of a whole, which tables print in percent"""
CRITERIA = {
    "pixel_scale": ("normalized pixel residual RMS", ""),
    "motion_scale": ("normalized motion residual RMS", ""),
    "used_share": ("observations used, of those recorded except far ones", SHARE),
    "weak_frames": ("frames with fewer than {weak_below} used observations", SHARE),
    "given_up_frames": ("frames whose observations were dropped", SHARE),
    "impossible_share": ("recorded observations, after repair, with a disparity of zero or less", SHARE),
    "untied_intervals": ("pairs of consecutive frames without a common landmark", SHARE),
    "batch_cost": ("negative log-likelihood above that of the batch solution", SHARE),
    "batch_position": ("position RMSE from the batch solution", "baselines"),
}
"""field of `TrustLimits` -> name and unit of its criterion; `{weak_below}` is replaced by that field"""
BATCH_CRITERIA = ("batch_cost", "batch_position")
AT_LEAST = frozenset({"used_share"})
"""criteria whose value must not fall below their limits"""


class Verdict(IntEnum):
    """Trust in a reference; the worst criterion decides."""

    TRUSTED = 0
    DOUBTFUL = 1
    UNTRUSTED = 2


@dataclass(frozen=True, slots=True)
class Criterion:
    """Measured value of one criterion of trust, with its limits and verdict."""

    code: str
    """name of the field of `TrustLimits`"""
    name: str
    value: float
    unit: str
    """`SHARE`, `baselines`, or empty for a ratio"""
    doubtful: float
    """limit beyond which the reference is doubtful"""
    untrusted: float
    """limit beyond which the reference is untrusted"""
    at_least: bool
    """whether the limits are lower bounds of the value; otherwise upper bounds"""
    verdict: Verdict
    remark: str = ""
    """note needed to interpret the value (inflated pixel sigma); empty without one"""


@dataclass(frozen=True, slots=True, repr=False)
class Trust(Displayed):
    """Verdict, its reasons in sentences, worst first, and the criteria that were measured."""

    verdict: Verdict
    reasons: tuple[str, ...]
    criteria: tuple[Criterion, ...] = ()
    against: tuple[str, ...] = ()
    """reasons whose own verdict is not TRUSTED; empty also where reasons have none (a failure, a saved run)"""

    def _heading(self) -> str:
        return f"Trust: {self.verdict.name.lower()}"

    def _facts(self) -> Mapping[str, str]:
        return {f"reason {i}": reason for i, reason in enumerate(self.reasons, 1)}


@dataclass(frozen=True, slots=True)
class TrustLimits:
    """Limits of each criterion: doubtful, untrusted."""

    pixel_scale: tuple[float, float] = (1.6, 3.0)
    """estimated over modeled pixel sigma: see `noise_scale.pixel_scale`"""
    motion_scale: tuple[float, float] = (1.4, 2.4)
    """normalized motion residual RMS per degree of freedom: see `noise_scale.motion_scale`"""
    used_share: tuple[float, float] = (0.6, 0.3)
    """share of the `expected_observations` that were used"""
    weak_frames: tuple[float, float] = (0.05, 0.25)
    """share of frames with fewer than `weak_below` used observations"""
    weak_below: int = 6
    """number of used observations below which a frame is weak"""
    untied_intervals: tuple[float, float] = (0.25, 0.6)
    """share of the pairs of consecutive frames without a common used landmark"""
    given_up_frames: tuple[float, float] = (0.0, 0.05)
    """share of frames whose observations were dropped"""
    batch_cost: tuple[float, float] = (0.005, 0.05)
    """relative excess of the cost of the reference over that of the batch solution"""
    batch_position: tuple[float, float] = (0.1, 2.0)
    """RMSE of the reference's positions from the batch solution, in baselines of the rig (0.1 m for one camera)"""
    impossible_share: tuple[float, float] = (0.2, 0.5)
    """share of the `expected_observations` without positive disparity"""


def trust(
    problem: Problem, reference: Estimate, batch: Estimate | None = None, limits: TrustLimits | None = None
) -> Trust:
    """Verdict on a reference by up to nine criteria, each with its limits: see `CRITERIA` and `TrustLimits`.

    The worst criterion decides. A reference that failed or used no observation is UNTRUSTED. It is DOUBTFUL or worse
    where `batch` was found from one start only. Residuals are compared with the noise model of the problem. Without a
    `batch` solution its two criteria are left out.
    """
    if reference.status is Status.FAILED:
        return Trust(Verdict.UNTRUSTED, (f"it failed: {reference.reason}",))
    limit = limits or TrustLimits()
    n_used = int(reference.used.sum())
    if n_used == 0:
        return Trust(Verdict.UNTRUSTED, ("it used no observation",))
    pixel, motion = pixel_scale(problem, reference), motion_scale(problem, reference)
    expected = expected_observations(problem)
    n_expected = max(1, int(expected.sum()))
    share = int((reference.used & expected).sum()) / n_expected
    impossible = int((expected & ~has_positive_disparity(problem)).sum()) / n_expected
    per_frame = np.bincount(problem.sequence.observations.frame[reference.used], minlength=problem.n_frames)
    weak = float(np.mean(per_frame < limit.weak_below))
    lost = {event.frame for event in reference.events if event.kind == EventKind.FRAME_WITHOUT_OBSERVATIONS}
    given_up = len(lost) / problem.n_frames
    inflated = inflation_remark(problem)
    expected_scale = (
        f"{number(1.0 / problem.pixel_inflation)} is expected of uncorrelated errors, as {inflated}"
        if inflated
        else "1 is expected"
    )
    recorded = "recorded ones" if problem.of_chosen_features.all() else "chosen tracks'"
    far = "" if problem.sequence.monocular else f" except far points (disparity of 0 to {FAR_POINT:g} px)"
    untied = int((problem.sequence.observations.select(reference.used).ties(problem.n_frames) == 0).sum())
    intervals = max(1, problem.n_frames - 1)
    motion_data = "velocities" if problem.imu is None else "inertial samples"
    judged = [
        (
            _criterion(limit, "pixel_scale", pixel, inflated),
            f"normalized pixel residual RMS {number(pixel)} (limit {limit.pixel_scale[0]:g}; {expected_scale})",
        ),
        (
            _criterion(limit, "motion_scale", motion),
            f"normalized motion residual RMS {number(motion)} (limit {limit.motion_scale[0]:g}; at most 1 is expected)",
        ),
        (
            _criterion(limit, "used_share", share, FAR_REMARK if far else ""),
            f"{reference.name} used {plural(n_used, 'observation')}: {per_cent(share)} of the {recorded}{far}, "
            f"{per_cent(n_used / max(1, int(problem.mask.sum())))} of the unmasked ones",
        ),
        (
            _criterion(limit, "weak_frames", weak),
            f"{per_cent(weak)} of the frames have fewer than {limit.weak_below} used observations" if weak else "",
        ),
        (
            _criterion(limit, "given_up_frames", given_up),
            f"the observations of {per_cent(given_up)} of the frames were dropped" if given_up else "",
        ),
        (
            _criterion(limit, "impossible_share", impossible),
            f"{per_cent(impossible)} of the observations have no positive disparity, though every point in view has one"
            if impossible > NOTABLE
            else "",
        ),
        (
            _criterion(limit, "untied_intervals", untied / intervals),
            f"{untied:,} of {plural(intervals, 'pair')} of consecutive frames ({per_cent(untied / intervals)}) have no "
            f"used landmark in common; there only the {motion_data} constrain the motion"
            if untied
            else "",
        ),
    ]
    in_batch = _compared_with_batch(problem, reference, batch, limit)
    findings = [(criterion.verdict, text + _limit_of(criterion)) for criterion, text in judged if text]
    if not problem.diagnosed:
        findings.append((Verdict.TRUSTED, "the recording was not diagnosed: its noise is assumed"))
    findings.append((in_batch.verdict, in_batch.reason))
    findings.sort(key=lambda finding: -finding[0])
    return Trust(
        max(verdict for verdict, _ in findings),
        tuple(text for _, text in findings),
        (*(criterion for criterion, _ in judged), *in_batch.criteria),
        tuple(text for verdict, text in findings if verdict is not Verdict.TRUSTED),
    )


def _limit_of(criterion: Criterion) -> str:
    """Limit that a share violates, in parentheses; empty otherwise: texts of the residuals always state theirs."""
    if criterion.verdict is Verdict.TRUSTED or criterion.unit != SHARE:
        return ""
    return f" (limit {limit_per_cent(criterion.doubtful)})"


def inflation_remark(problem: Problem) -> str:
    """Clause on the inflation of the pixel noise; empty below `NOTABLE_INFLATION`."""
    if problem.pixel_inflation < NOTABLE_INFLATION:
        return ""
    return f"the pixel sigma is inflated by a factor of {problem.pixel_inflation:.3g} for time-correlated track errors"


def _criterion(limits: TrustLimits, code: str, value: float, remark: str = "") -> Criterion:
    doubtful, untrusted = getattr(limits, code)
    title, unit = CRITERIA[code]
    name = title.format(weak_below=limits.weak_below)
    at_least = code in AT_LEAST
    verdict = (_verdict_below if at_least else _verdict_above)(value, (doubtful, untrusted))
    return Criterion(code, name, value, unit, doubtful, untrusted, at_least, verdict, remark)


def expected_observations(problem: Problem) -> BoolArray:
    """Mask (n,) of the observations that count in `used_share`: those of chosen features, masked or not.

    Masked far points (disparity above 0, at most FAR_POINT px) do not count, as they determine no depth. Observations
    without positive disparity count: no point in front of the cameras has them.
    """
    d = disparity(problem.sequence.observations.pixel)
    counted = problem.of_chosen_features & ~((d > 0.0) & (d <= FAR_POINT))
    return np.asarray(problem.mask | counted, dtype=np.bool_)


def has_positive_disparity(problem: Problem) -> BoolArray:
    """Mask (n,) of the observations with positive disparity, as every point at a finite distance in front of the
    cameras has. All True for one camera, which measures no disparity."""
    if problem.sequence.monocular:
        return np.ones(len(problem.excluded), dtype=np.bool_)
    return np.asarray(disparity(problem.sequence.observations.pixel) > 0.0, dtype=np.bool_)


class _BatchComparison(NamedTuple):
    verdict: Verdict
    reason: str
    criteria: tuple[Criterion, ...] = ()


def _compared_with_batch(
    problem: Problem, reference: Estimate, batch: Estimate | None, limit: TrustLimits
) -> _BatchComparison:
    """Cost and positions of the reference beside those of the batch solution, over the observations that both used."""
    if batch is None or batch.status is Status.FAILED:
        why = "" if batch is None else f": that failed, {batch.reason}"
        return _BatchComparison(Verdict.TRUSTED, f"not compared with a batch solution{why}")
    kinds = {event.kind for event in batch.events}
    if EventKind.ONE_START in kinds:
        return _BatchComparison(
            Verdict.DOUBTFUL,
            "a batch solution was found from one start only: no second start confirms that it is the lowest minimum",
        )
    if batch is reference:
        return _BatchComparison(Verdict.TRUSTED, "it is the batch solution itself")
    both = reference.used & batch.used
    excess = cost(problem, reference, both) / cost(problem, batch, both) - 1.0
    apart = reference.world_T_imu[:, :3, 3] - batch.world_T_imu[:, :3, 3]
    rmse = rms_norm(apart)
    baselines = rmse / problem.sequence.camera.unit_length
    remark = "" if problem.sequence.monocular else f"1 baseline: {problem.sequence.camera.unit_length:.3g} m"
    position = _criterion(limit, "batch_position", baselines, remark)
    lengths = f", {baselines:.2g} baselines"
    if problem.sequence.monocular:  # one camera has no baseline: the unit is UNIT_LENGTH
        position, lengths = replace(position, unit=f"{UNIT_LENGTH:g} m"), ""
    criteria = (_criterion(limit, "batch_cost", excess), position)
    verdict = max(criterion.verdict for criterion in criteria)
    start = ", started at isam2's solution," if EventKind.STARTED_AT_ISAM2 in kinds else ""
    agrees = "agrees" if verdict is Verdict.TRUSTED else "disagrees"
    side = "above" if excess > 0.0 else "below"
    cost_gap = f"{per_cent(abs(excess))} {side} the batch's" if abs(excess) >= RESOLUTION else "the same"
    path_gap = f"differs by {distance(rmse)} (RMSE{lengths})" if rmse >= RESOLUTION else "is the same"
    text = f"a batch solution{start} {agrees}: the negative log-likelihood is {cost_gap}, the trajectory {path_gap}"
    return _BatchComparison(verdict, text, criteria)


def _verdict_above(value: float, limits: tuple[float, float]) -> Verdict:
    return Verdict(int(not value <= limits[0]) + int(not value <= limits[1]))


def _verdict_below(value: float, limits: tuple[float, float]) -> Verdict:
    return Verdict(int(not value >= limits[0]) + int(not value >= limits[1]))
