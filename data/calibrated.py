"""The `calibrated` preset: noise per velocity sample, a mask against wrong matches, all features, no landmark prior."""

from dataclasses import dataclass, field

import numpy as np

from .documented import most_observed
from .motion import Interval, dead_reckoned_path, increments
from .problem import Excluded, HuberKernel, Problem
from .sequence import Sequence
from .track_mask import MaskSettings, exclusions


@dataclass(frozen=True, slots=True)
class NoiseSettings:
    """Standard deviations that stand in until a diagnosis has estimated them from the recording."""

    pixel: float = 1.5
    """px, of each of the four rows"""
    linear_velocity: float = 0.3
    """m/s, of the velocity held over an interval"""
    angular_velocity: float = 0.03
    """rad/s, of the rate held over an interval"""


@dataclass(frozen=True, slots=True)
class Calibration:
    """The settings of the preset."""

    noise: NoiseSettings = field(default_factory=NoiseSettings)
    interval: Interval = Interval.MEAN
    mask: MaskSettings = field(default_factory=MaskSettings)
    kernel: HuberKernel | None = field(default_factory=HuberKernel)


def calibrated(sequence: Sequence, features: int | None = None, settings: Calibration | None = None) -> Problem:
    """The problem that the recording supports, the first pose held at the identity.

    The noise of an increment is the standard deviation of a velocity times dt. The mean of two samples over an
    interval makes the errors of neighbouring increments correlated; that correlation is not modelled.
    `features` keeps only that many landmarks, those seen most often after masking.
    """
    c = settings or Calibration()
    step = increments(sequence, c.interval)
    excluded = exclusions(sequence, dead_reckoned_path(step), c.mask)
    usable = sequence.observations.select(excluded == Excluded.NO)
    chosen = most_observed(usable, sequence.n_landmarks, features)
    left_out = (excluded == Excluded.NO) & ~np.isin(sequence.observations.landmark, chosen)
    excluded[left_out] = Excluded.FEATURE_NOT_CHOSEN
    sigma = np.repeat([c.noise.linear_velocity, c.noise.angular_velocity], 3)
    variance = (sequence.dt[:, None] * sigma) ** 2
    return Problem(
        preset="calibrated",
        sequence=sequence,
        increment=step,
        increment_covariance=variance[:, :, None] * np.eye(6),
        pixel_variance=c.noise.pixel**2,
        features=chosen,
        excluded=excluded,
        initial_pose=np.eye(4),
        initial_covariance=np.zeros((6, 6)),
        kernel=c.kernel,
        remarks=(
            f"not diagnosed: {c.noise.pixel:g} px, {c.noise.linear_velocity:g} m/s and {c.noise.angular_velocity:g} "
            f"rad/s are assumed, not estimated from the recording",
            f"the {c.interval} of the velocity samples moves each interval"
            + ("; the correlation of neighbouring increments is not modelled" if c.interval is Interval.MEAN else ""),
        ),
    )
