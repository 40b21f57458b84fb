"""Axis conventions of the recorded velocities: all 24 right-handed ones scored against odometry."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS, IDENTITY, axes_matrix
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, so3

from ..robust_scale import CHI_SQUARE_MEDIAN
from .robust_regression import regress

LAGS = (-2, -1, 0, 1, 2)
"""frames, tried with every convention so that a delay is not taken for another axis"""
ENOUGH = 25.0
"""log-likelihood lead at which the data determine the convention"""
MISALIGNMENT, LEVER_ARM, SCALE = np.deg2rad(2.0), 0.3, 0.05
"""rad, baselines and share: largest errors of a valid calibration; what they explain is no evidence for another"""
MAX_BIAS = 1.0
"""rad/s"""
GAIN_RANGE, GAIN_DEVIATION = 0.35, 0.12
"""an axis is seen where its recorded component follows the cameras' with a gain this near to 1, known this well"""
EXCITED = 2.0
"""factor on the leakage of 1-sigma calibration errors into a component, above which it is excited by itself"""

Design = Callable[[FloatArray, BoolArray], FloatArray]
"""the regressors (n, 3, p) of calibration errors, of turned recorded velocities (n, 3) at chosen intervals"""


@dataclass(frozen=True, eq=False, slots=True)
class Axes:
    """The estimated convention of one velocity."""

    name: str
    """such as 'x,-y,-z'"""
    seen: tuple[bool, bool, bool]
    """axes of imu_T_cam that the data determine"""
    margin: float
    """log-likelihood lead over the best convention that differs on a determined axis"""
    before: float
    """median error against odometry as recorded, m/s or rad/s"""
    after: float
    """median error in this convention"""
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


def angular_axes(seen: FloatArray, recorded: FloatArray, known: BoolArray) -> Axes:
    """The convention of the angular velocity: `seen` (T-1, 3) by odometry, `recorded` (T-1, 3), rad/s."""

    def design(x: FloatArray, _: BoolArray) -> FloatArray:
        return np.concatenate([-so3.hat3(x), np.tile(np.eye(3), (len(x), 1, 1))], axis=2)

    scores, _ = _scores(seen, recorded, known, design, np.repeat([MISALIGNMENT, MAX_BIAS], 3))
    best = max(scores, key=lambda name: scores[name])
    axes = tuple(_lead(scores, best, axis) > ENOUGH for axis in range(3))
    return _decided(scores, best, axes, (IDENTITY,), seen, recorded, known)


def linear_axes(
    seen: FloatArray, recorded: FloatArray, rate: FloatArray, known: BoolArray, angular: str, baseline: float
) -> Axes:
    """The convention of the linear velocity, m/s; `rate` (T-1, 3) is the angular velocity of the odometry,
    `baseline` that of the stereo camera in m.

    A car excites only its forward axis: the small components are explained as well by a slightly wrong extrinsic. An
    axis therefore counts as determined only where its component is larger than that, and follows the odometry with a
    gain near one. An undetermined axis stays as recorded, or follows the `angular` convention.
    """

    def design(x: FloatArray, chosen: BoolArray) -> FloatArray:
        return np.concatenate([-so3.hat3(x), so3.hat3(rate[chosen]), x[:, :, None]], axis=2)

    lever_arm = LEVER_ARM * baseline
    prior = np.array([MISALIGNMENT] * 3 + [lever_arm] * 3 + [SCALE])
    scores, lags = _scores(seen, recorded, known, design, prior)
    best = max(scores, key=lambda name: scores[name])
    shifted, chosen = _lagged(recorded, known, lags[best])
    turned = shifted[chosen] @ axes_matrix(best).T
    excited = _excited(seen[chosen], turned, rate[chosen], lever_arm)
    follows = _follows(seen[chosen], turned, rate[chosen], lever_arm)
    axes = tuple(excited[i] and follows[i] and _lead(scores, best, i) > ENOUGH for i in range(3))
    return _decided(scores, best, axes, (IDENTITY, angular), seen, recorded, known)


def _scores(
    seen: FloatArray, recorded: FloatArray, known: BoolArray, design: Design, prior: FloatArray
) -> tuple[dict[str, float], dict[str, int]]:
    """Log-likelihood of each convention at its best lag, and this lag."""
    scores, lags = dict.fromkeys(AXIS_CONVENTIONS, -np.inf), dict.fromkeys(AXIS_CONVENTIONS, 0)
    for lag in LAGS:
        shifted, chosen = _lagged(recorded, known, lag)
        for name in AXIS_CONVENTIONS:
            x = shifted[chosen] @ axes_matrix(name).T
            fit = regress(seen[chosen] - x, design(x, chosen), prior)
            # fewer samples at a larger lag: compared per sample
            score = fit.log_likelihood * known.sum() / chosen.sum()
            if score > scores[name]:
                scores[name], lags[name] = score, lag
    return scores, lags


def _lagged(recorded: FloatArray, known: BoolArray, lag: int) -> tuple[FloatArray, BoolArray]:
    """Sample k + lag in the place of k, and the known intervals (T-1,) that have one."""
    chosen = known.copy()
    if lag > 0:
        chosen[-lag:] = False
    elif lag < 0:
        chosen[:-lag] = False
    return np.roll(recorded, -lag, axis=0), chosen


def _lead(scores: dict[str, float], best: str, axis: int) -> float:
    """Lead of the best convention, in log-likelihood, over all with another component on this axis."""
    row = best.split(",")[axis]
    return scores[best] - max(score for name, score in scores.items() if name.split(",")[axis] != row)


def _excited(seen: FloatArray, x: FloatArray, rate: FloatArray, lever_arm: float) -> list[bool]:
    """For each axis, whether its motion is more than honest calibration errors leak in from the others and the rates.

    The size of a component is that of what cameras and recording agree on: the noise of neither adds to it.
    """
    reach = np.abs(x).max(axis=0)
    power = np.maximum(np.mean(np.clip(seen, -reach, reach) * x, axis=0), 0.0)
    turning = np.median(rate**2, axis=0) / CHI_SQUARE_MEDIAN[1]
    leak = MISALIGNMENT**2 * (power.sum() - power) + lever_arm**2 * (turning.sum() - turning)
    return [bool(p > EXCITED**2 * q) for p, q in zip(power, leak, strict=True)]


def _follows(seen: FloatArray, x: FloatArray, rate: FloatArray, lever_arm: float) -> list[bool]:
    """For each axis, whether the cameras' velocity follows the turned recorded one with a gain near 1."""
    follows = []
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        # a slightly turned extrinsic leaks the other components in, a wrong lever arm the rates
        columns = np.column_stack([x[:, axis], x[:, others], rate[:, others]])
        prior = np.array([10.0, MISALIGNMENT, MISALIGNMENT, lever_arm, lever_arm])
        fit = regress(seen[:, axis, None], columns[:, None, :], prior)
        deviation = float(np.sqrt(fit.covariance[0, 0]))
        follows.append(abs(float(fit.theta[0]) - 1.0) < GAIN_RANGE and deviation < GAIN_DEVIATION)
    return follows


def _decided(
    scores: dict[str, float],
    best: str,
    axes: tuple[bool, ...],
    preferred: tuple[str, ...],
    seen: FloatArray,
    recorded: FloatArray,
    known: BoolArray,
) -> Axes:
    """Convention that has the components of the best one on the excited `axes`, a preferred one if possible."""
    parts = best.split(",")
    agreeing = [n for n in scores if all(n.split(",")[i] == parts[i] for i in range(3) if axes[i])]
    name = next((n for n in preferred if n in agreeing), best)
    lead = min((_lead(scores, best, axis) for axis in range(3) if axes[axis]), default=0.0)

    def error(convention: str) -> float:
        difference = seen[known] - recorded[known] @ axes_matrix(convention).T
        return float(np.median(np.linalg.norm(difference, axis=1)))

    return Axes(name, (bool(axes[0]), bool(axes[1]), bool(axes[2])), lead, error(IDENTITY), error(name), scores)
