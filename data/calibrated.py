"""The `calibrated` preset: what the data support. Repaired, masked, with the noise that was found, without priors."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .diagnose import Diagnosis, diagnose, repair
from .documented import most_observed
from .motion import Shift, dead_reckoned_path, increments
from .problem import Excluded, HuberKernel, Problem
from .sequence import Sequence
from .track_mask import MaskSettings, exclusions


@dataclass(frozen=True, slots=True)
class NoiseSettings:
    """Standard deviations; the defaults stand in where a recording could not be diagnosed."""

    pixel: float = 1.5
    """px, of each of the four rows"""
    linear_velocity: float = 0.3
    """m/s, of the velocity held over an interval"""
    angular_velocity: float = 0.03
    """rad/s, of the rate held over an interval"""


@dataclass(frozen=True, slots=True)
class Calibration:
    """Settings in place of a diagnosis: the recording is taken as it is."""

    noise: NoiseSettings = field(default_factory=NoiseSettings)
    shift: float = Shift.MIDDLE
    """intervals: see `motion.held_twist`"""
    mask: MaskSettings = field(default_factory=MaskSettings)
    kernel: HuberKernel | None = field(default_factory=HuberKernel)


def calibrated(
    sequence: Sequence,
    features: int | None = None,
    *,
    diagnosis: Diagnosis | None = None,
    settings: Calibration | None = None,
) -> Problem:
    """The problem that the recording supports, the first pose held at the identity.

    Without `settings` the recording is diagnosed (unless a `diagnosis` of it is given) and repaired, and the noise is
    what the diagnosis found; where it cannot tell, or with `settings`, the recording is taken as it is. The noise of an
    increment is the standard deviation of a velocity times dt. A fractional shift makes the errors of neighbouring
    increments correlated; that is not modelled. `features` keeps only that many landmarks, those seen most often after
    masking.
    """
    if settings is None:
        diagnosis = diagnosis or diagnose(sequence)
        if diagnosis.sigmas is not None:
            return _diagnosed(diagnosis, features)
    problem = _as_recorded(sequence, features, settings or Calibration())
    if diagnosis is None or not diagnosis.cannot_tell:
        return problem
    return replace(problem, remarks=(f"not diagnosed: {diagnosis.cannot_tell}", *problem.remarks))


def _diagnosed(diagnosis: Diagnosis, features: int | None) -> Problem:
    sigmas = diagnosis.sigmas
    assert sigmas is not None
    repaired = repair(diagnosis, MaskSettings())
    noise = NoiseSettings(sigmas.pixel, sigmas.linear, sigmas.angular)
    remarks = (
        f"noise found in the recording: {sigmas.pixel:.2f} px, {sigmas.linear:.3f} m/s and {sigmas.angular:.4f} rad/s",
        *repaired.repairs,
    )
    kernel = HuberKernel()
    return _posed(repaired.sequence, repaired.excluded, features, noise, diagnosis.shift, kernel, remarks, True)


def _as_recorded(sequence: Sequence, features: int | None, settings: Calibration) -> Problem:
    noise, shift = settings.noise, settings.shift
    excluded = exclusions(sequence, dead_reckoned_path(increments(sequence, shift)), settings.mask)
    remarks = (
        f"not diagnosed: {noise.pixel:g} px, {noise.linear_velocity:g} m/s and {noise.angular_velocity:g} rad/s are "
        "assumed, not estimated from the recording",
        f"velocities taken as recorded, shifted by {float(shift):+g} intervals"
        + ("" if float(shift).is_integer() else "; the correlation of neighbouring increments is not modelled"),
    )
    return _posed(sequence, excluded, features, noise, shift, settings.kernel, remarks, False)


def _posed(
    sequence: Sequence,
    excluded: NDArray[np.uint8],
    features: int | None,
    noise: NoiseSettings,
    shift: float,
    kernel: HuberKernel | None,
    remarks: tuple[str, ...],
    diagnosed: bool,
) -> Problem:
    usable = sequence.observations.select(excluded == Excluded.NO)
    chosen = most_observed(usable, sequence.n_landmarks, features)
    left_out = (excluded == Excluded.NO) & ~np.isin(sequence.observations.landmark, chosen)
    excluded[left_out] = Excluded.FEATURE_NOT_CHOSEN
    sigma = np.repeat([noise.linear_velocity, noise.angular_velocity], 3)
    variance = (sequence.dt[:, None] * sigma) ** 2
    return Problem(
        preset="calibrated",
        sequence=sequence,
        increment=increments(sequence, shift),
        increment_covariance=variance[:, :, None] * np.eye(6),
        pixel_variance=noise.pixel**2,
        features=chosen,
        excluded=excluded,
        initial_pose=np.eye(4),
        initial_covariance=np.zeros((6, 6)),
        kernel=kernel,
        diagnosed=diagnosed,
        remarks=remarks,
    )
