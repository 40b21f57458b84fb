"""Axis conventions of the recorded velocities: the 24 right-handed ones, scored against visual odometry."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS, IDENTITY, axes_matrix
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, so3

from ..robust_constants import CHI_SQUARE_MEDIAN
from .robust_regression import regress

LAGS = (-2, -1, 0, 1, 2)
"""frames; each convention is tried at each lag, so that a delay is not mistaken for other axes"""
ENOUGH = 25.0
"""log-likelihood lead above which the data determine an axis"""
MISALIGNMENT = np.deg2rad(2.0)
"""rad, prior 1-sigma of the rotation error of the extrinsics"""
LEVER_ARM = 0.3
"""baselines, prior 1-sigma of the translation error of the extrinsics"""
SCALE = 0.05
"""prior 1-sigma of the relative scale error of a speed"""
MAX_BIAS = 1.0
"""rad/s, prior 1-sigma of the gyroscope bias"""
GAIN_RANGE = 0.35
"""largest deviation from 1 of the gain from recorded component to odometry, on an axis that the data determine"""
GAIN_DEVIATION = 0.12
"""largest 1-sigma of this gain"""
EXCITED = 2.0
"""smallest ratio of an excited component to the leakage of 1-sigma calibration errors into it"""

Design = Callable[[FloatArray, BoolArray], FloatArray]
"""regressors (n, 3, p) of calibration errors, from velocities (n, 3) in a convention and the mask (T-1,) of these"""


@dataclass(frozen=True, eq=False, slots=True)
class Axes:
    """Estimated axis convention of the angular or the linear velocity."""

    name: str
    """recorded component on each axis of imu_T_cam, such as 'x,-y,-z'"""
    determined: tuple[bool, bool, bool]
    """whether the data determine x, y and z of imu_T_cam"""
    margin: float
    """log-likelihood lead over the best convention that differs on a determined axis; 0 if no axis is determined"""
    before: float
    """median difference from odometry in the axes as recorded, m/s or rad/s"""
    after: float
    """median difference from odometry in this convention, m/s or rad/s"""
    scores: dict[str, float] = field(default_factory=dict)
    """log-likelihood of each of the 24 conventions, at its best lag"""

    @property
    def matrix(self) -> FloatArray:
        """Rotation (3, 3) from the recorded axes to the axes of imu_T_cam."""
        return axes_matrix(self.name)

    @property
    def changed(self) -> bool:
        """Whether the recording uses other axes than imu_T_cam."""
        return self.name != IDENTITY


def angular_axes(visual: FloatArray, recorded: FloatArray, known: BoolArray) -> Axes:
    """Convention of the angular velocity `recorded` (T-1, 3), from that of the odometry, `visual` (T-1, 3), rad/s.

    `known` (T-1,) is the mask of the intervals with odometry.
    """

    def design(x: FloatArray, _: BoolArray) -> FloatArray:
        return np.concatenate([-so3.hat3(x), np.tile(np.eye(3), (len(x), 1, 1))], axis=2)

    scores, _ = _scores(visual, recorded, known, design, np.repeat([MISALIGNMENT, MAX_BIAS], 3))
    best = max(scores, key=lambda name: scores[name])
    axes = tuple(_lead(scores, best, axis) > ENOUGH for axis in range(3))
    return _decided(scores, best, axes, (IDENTITY,), visual, recorded, known)


def linear_axes(
    visual: FloatArray, recorded: FloatArray, rate: FloatArray, known: BoolArray, angular: str, baseline: float
) -> Axes:
    """Convention of the linear velocity `recorded` (T-1, 3), from that of the odometry, `visual` (T-1, 3), m/s.

    `rate` (T-1, 3), rad/s, is the angular velocity of the odometry, `known` (T-1,) the mask of its intervals, `angular`
    the convention of the angular velocity and `baseline` the stereo baseline, m.

    A car excites only its forward axis; a small error of the extrinsics explains its other components. An axis is
    therefore determined only if its component is larger than these errors explain and follows the odometry with a gain
    near 1. Undetermined axes are as recorded if the determined ones allow it, else as in `angular`.
    """

    def design(x: FloatArray, chosen: BoolArray) -> FloatArray:
        return np.concatenate([-so3.hat3(x), so3.hat3(rate[chosen]), x[:, :, None]], axis=2)

    lever_arm = LEVER_ARM * baseline
    prior = np.array([MISALIGNMENT] * 3 + [lever_arm] * 3 + [SCALE])
    scores, lags = _scores(visual, recorded, known, design, prior)
    best = max(scores, key=lambda name: scores[name])
    shifted, chosen = _lagged(recorded, known, lags[best])
    turned = shifted[chosen] @ axes_matrix(best).T
    excited = _excited(visual[chosen], turned, rate[chosen], lever_arm)
    follows = _follows(visual[chosen], turned, rate[chosen], lever_arm)
    axes = tuple(excited[i] and follows[i] and _lead(scores, best, i) > ENOUGH for i in range(3))
    return _decided(scores, best, axes, (IDENTITY, angular), visual, recorded, known)


def _scores(
    visual: FloatArray, recorded: FloatArray, known: BoolArray, design: Design, prior: FloatArray
) -> tuple[dict[str, float], dict[str, int]]:
    """Log-likelihood of each convention at its best lag, and that lag in frames."""
    scores, lags = dict.fromkeys(AXIS_CONVENTIONS, -np.inf), dict.fromkeys(AXIS_CONVENTIONS, 0)
    for lag in LAGS:
        shifted, chosen = _lagged(recorded, known, lag)
        for name in AXIS_CONVENTIONS:
            x = shifted[chosen] @ axes_matrix(name).T
            fit = regress(visual[chosen] - x, design(x, chosen), prior)
            # a larger lag leaves fewer samples: the likelihood is scaled to the same number
            score = fit.log_likelihood * known.sum() / chosen.sum()
            if score > scores[name]:
                scores[name], lags[name] = score, lag
    return scores, lags


def _lagged(recorded: FloatArray, known: BoolArray, lag: int) -> tuple[FloatArray, BoolArray]:
    """Samples shifted so that row k is sample k + lag, and the mask (T-1,) of known intervals that have this sample."""
    chosen = known.copy()
    if lag > 0:
        chosen[-lag:] = False
    elif lag < 0:
        chosen[:-lag] = False
    return np.roll(recorded, -lag, axis=0), chosen


def _lead(scores: dict[str, float], best: str, axis: int) -> float:
    """Log-likelihood lead of the best convention over all that differ from it on this axis."""
    component = best.split(",")[axis]
    return scores[best] - max(score for name, score in scores.items() if name.split(",")[axis] != component)


def _excited(visual: FloatArray, x: FloatArray, rate: FloatArray, lever_arm: float) -> list[bool]:
    """For each axis, whether its component exceeds the leakage of calibration errors from other axes and from turning.

    The power of a component is its mean product in odometry and recording, to which independent noise does not add.
    """
    reach = np.abs(x).max(axis=0)
    power = np.maximum(np.mean(np.clip(visual, -reach, reach) * x, axis=0), 0.0)
    turning = np.median(rate**2, axis=0) / CHI_SQUARE_MEDIAN[1]
    leak = MISALIGNMENT**2 * (power.sum() - power) + lever_arm**2 * (turning.sum() - turning)
    return [bool(p > EXCITED**2 * q) for p, q in zip(power, leak, strict=True)]


def _follows(visual: FloatArray, x: FloatArray, rate: FloatArray, lever_arm: float) -> list[bool]:
    """For each axis, whether the velocity of the odometry follows the recorded one with a gain near 1."""
    follows = []
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        # A rotation error of the extrinsics leaks the other components into this one, a lever-arm error the rates.
        columns = np.column_stack([x[:, axis], x[:, others], rate[:, others]])
        prior = np.array([10.0, MISALIGNMENT, MISALIGNMENT, lever_arm, lever_arm])
        fit = regress(visual[:, axis, None], columns[:, None, :], prior)
        deviation = float(np.sqrt(fit.covariance[0, 0]))
        follows.append(abs(float(fit.theta[0]) - 1.0) < GAIN_RANGE and deviation < GAIN_DEVIATION)
    return follows


def _decided(
    scores: dict[str, float],
    best: str,
    axes: tuple[bool, ...],
    preferred: tuple[str, ...],
    visual: FloatArray,
    recorded: FloatArray,
    known: BoolArray,
) -> Axes:
    """Convention that agrees with the best one on the determined `axes`: one of `preferred` if any, else the best."""
    parts = best.split(",")
    agreeing = [n for n in scores if all(n.split(",")[i] == parts[i] for i in range(3) if axes[i])]
    name = next((n for n in preferred if n in agreeing), best)
    lead = min((_lead(scores, best, axis) for axis in range(3) if axes[axis]), default=0.0)

    def error(convention: str) -> float:
        difference = visual[known] - recorded[known] @ axes_matrix(convention).T
        return float(np.median(np.linalg.norm(difference, axis=1)))

    return Axes(name, (bool(axes[0]), bool(axes[1]), bool(axes[2])), lead, error(IDENTITY), error(name), scores)
