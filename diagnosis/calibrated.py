"""The `calibrated` preset: a repaired and masked recording with the estimated noise and without priors."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.motion import Shift, dead_reckoned_path, increments
from fgbaseline.data.problem import NoiseSettings, Problem
from fgbaseline.data.problem.velocity_gaps import inflate_gap_covariance
from fgbaseline.data.sequence import Sequence, require_scale
from fgbaseline.data.wording import plural
from fgbaseline.geometry import HuberKernel, InputError

from .estimation.pipeline import diagnose
from .estimation.result import Diagnosis
from .findings.track_statistics import track_statistics
from .findings.velocity_findings import findings_of, rescalings
from .inertial.pipeline import diagnose_inertial
from .inertial.problem import as_recorded_inertial, inertial_problem
from .monocular.problem import as_recorded_monocular, monocular_problem
from .repair_overrides.application import mask_settings, override_sentences, with_given_units, with_overrides
from .repair_overrides.settings import Repairs
from .repairs.dropout import averaged_over_dropouts, dropout_intervals
from .repairs.repaired_sequence import repair
from .tracks.observation_mask import MaskSettings, choose_features, exclusions


@dataclass(frozen=True, slots=True)
class Calibration:
    """Settings in place of a diagnosis: the recording is taken as recorded."""

    noise: NoiseSettings = field(default_factory=NoiseSettings)
    shift: float = Shift.AFTER
    """intervals: see `motion.zero_order_hold`; as recorded, the velocity of frame k moves frame k to k + 1"""
    mask: MaskSettings = field(default_factory=MaskSettings)
    kernel: HuberKernel | None = field(default_factory=HuberKernel)


def calibrated(
    sequence: Sequence,
    features: int | None = None,
    *,
    diagnosis: Diagnosis | None = None,
    settings: Calibration | None = None,
    repairs: Repairs | None = None,
    processes: int = 1,
) -> Problem:
    """The problem that the recording supports, with the first pose fixed at the identity.

    Without `settings` the recording is diagnosed (unless its `diagnosis` is given) and repaired, with the estimated
    noise. Where nothing can be estimated, or with `settings`, the recording is taken as recorded. Values in `repairs`
    take precedence over the diagnosis. The noise of an increment is the standard deviation of a velocity times dt. A
    fractional shift correlates the errors of neighboring increments, which is not modeled. `features` keeps that many
    landmarks, those observed most often after masking. With raw inertial samples the problem has a start in place of
    increments, and the noise that the recording states. The number of `processes` does not change the result. Raises
    InputError for impossible repairs, for repairs together with `settings`, and where the units are in doubt.
    """
    require_scale(sequence)
    if sequence.imu is not None:
        return _inertial(sequence, features, settings, repairs, processes)
    if settings is not None and repairs is not None:
        raise InputError("repairs: a recording that is taken as it is has none; give repairs or settings, not both")
    if settings is None:
        diagnosis = with_given_units(diagnosis or diagnose(sequence, processes), repairs or Repairs())
        if diagnosis.units.doubt:
            raise InputError(f"{sequence.source or sequence.name}: {diagnosis.units.doubt}")
        sequence = diagnosis.sequence
        if diagnosis.sigmas is not None or repairs is not None:
            return _diagnosed(diagnosis, features, repairs or Repairs())
    problem = inflate_gap_covariance(_as_recorded(sequence, features, settings or Calibration()))
    if diagnosis is None or not diagnosis.cannot_tell:
        return problem
    return replace(
        problem,
        remarks=(f"not diagnosed: {diagnosis.cannot_tell}", *problem.remarks),
        findings=findings_of(diagnosis),
        repairs=rescalings(diagnosis),
    )


def _inertial(
    sequence: Sequence, features: int | None, settings: Calibration | None, repairs: Repairs | None, processes: int
) -> Problem:
    """The problem of a recording with raw inertial samples, whose start takes the place of velocities."""
    if repairs is not None:
        raise InputError("repairs: a recording with raw inertial samples has none that can be set; leave them out")
    if sequence.monocular:
        if settings is not None:
            return as_recorded_monocular(sequence, features, settings.noise.pixel, settings.kernel)
        return monocular_problem(diagnose_inertial(sequence), features)
    if settings is not None:
        return as_recorded_inertial(sequence, features, settings.noise.pixel, settings.mask, settings.kernel)
    return inertial_problem(diagnose_inertial(sequence, processes), features)


def _diagnosed(found: Diagnosis, features: int | None, repairs: Repairs) -> Problem:
    diagnosis = with_overrides(found, repairs)
    mask, tracks = mask_settings(repairs)
    repaired = repair(diagnosis, mask, tracks)
    noise = diagnosis.sigmas or NoiseSettings()
    remarks = (
        *((f"not diagnosed: {found.cannot_tell}",) if found.cannot_tell else ()),
        f"noise {_origin(found, repairs)}: {noise.pixel:.2f} px, {noise.linear_velocity:.3f} m/s and "
        f"{noise.angular_velocity:.4f} rad/s",
    )
    problem = _with_features(
        repaired.sequence, repaired.excluded, features, noise, diagnosis.shift, HuberKernel(), remarks
    )
    return replace(
        inflate_gap_covariance(_with_outlier_noise(_bridged(problem, diagnosis, noise), diagnosis)),
        pixel_inflation=1.0 if found.fit is None or repairs.sigma.pixel is not None else found.fit.inflation.pixel,
        diagnosed=not found.cannot_tell,
        findings=findings_of(found, track_statistics(found, repaired if repairs == Repairs() else None)),
        repairs=(*override_sentences(repairs), *rescalings(found), *repaired.repairs),
    )


def _origin(found: Diagnosis, repairs: Repairs) -> str:
    given = len(repairs.sigma.model_dump(exclude_none=True))
    rest = "found in the recording" if found.sigmas is not None else "assumed, not estimated from the recording"
    return rest if given == 0 else "user-specified" if given == 3 else f"user-specified in part, the rest {rest}"


def _bridged(problem: Problem, diagnosis: Diagnosis, noise: NoiseSettings) -> Problem:
    """The problem with velocities averaged over neighbors in short visual dropouts."""
    sequence, odometry = problem.sequence, diagnosis.odometry
    blind = dropout_intervals(problem.observations(), problem.n_frames)
    if odometry is None or not blind.any():
        return problem
    dt = sequence.dt[:, None]
    sigma = np.repeat([noise.linear_velocity, noise.angular_velocity], 3)
    found = averaged_over_dropouts(problem.increment / dt, odometry.twist(sequence.dt), blind, sigma)
    if len(found.blind) == 0:
        return problem
    linear, angular = (np.sqrt(np.mean(found.deviation[found.blind, part] ** 2)) for part in (slice(3), slice(3, 6)))
    remark = (
        f"over {plural(len(found.blind), 'interval')} that the cameras do not see, velocities are averaged over "
        f"neighbors: their noise is {linear:.3f} m/s and {angular:.4f} rad/s there"
    )
    return replace(
        problem,
        increment=found.twist * dt,
        increment_covariance=(dt * found.deviation)[:, :, None] ** 2 * np.eye(6),
        remarks=(*problem.remarks, remark),
    )


def _with_outlier_noise(problem: Problem, diagnosis: Diagnosis) -> Problem:
    """The problem with the error of the velocities that are interpolated in place of outliers."""
    if diagnosis.outliers is None:
        return problem
    deviation = diagnosis.outliers.of_intervals(diagnosis.shift, diagnosis.linear.matrix, diagnosis.angular.matrix)
    added = (deviation * problem.sequence.dt[:, None]) ** 2
    return replace(problem, increment_covariance=problem.increment_covariance + added[:, :, None] * np.eye(6))


def _as_recorded(sequence: Sequence, features: int | None, settings: Calibration) -> Problem:
    noise, shift = settings.noise, settings.shift
    excluded = exclusions(sequence, dead_reckoned_path(increments(sequence, shift)), settings.mask)
    remarks = (
        f"not diagnosed: {noise.pixel:g} px, {noise.linear_velocity:g} m/s and {noise.angular_velocity:g} rad/s are "
        "assumed, not estimated from the recording",
        _shift_remark(shift),
    )
    return _with_features(sequence, excluded, features, noise, shift, settings.kernel, remarks)


def _shift_remark(shift: float) -> str:
    if shift == Shift.AFTER:
        return "velocities taken as recorded: the velocity of frame k moves frame k to k + 1"
    remark = f"velocities taken as recorded, shifted by {float(shift):+g} intervals"
    correlated = "" if float(shift).is_integer() else "; the correlation of neighboring increments is not modeled"
    return remark + correlated


def _with_features(
    sequence: Sequence,
    excluded: NDArray[np.uint8],
    features: int | None,
    noise: NoiseSettings,
    shift: float,
    kernel: HuberKernel | None,
    remarks: tuple[str, ...],
) -> Problem:
    chosen, excluded = choose_features(sequence, excluded, features)
    sigma = np.repeat([noise.linear_velocity, noise.angular_velocity], 3)
    variance = (sequence.dt[:, None] * sigma) ** 2
    return Problem(
        preset="calibrated",
        findings=sequence.findings,
        sequence=sequence,
        increment=increments(sequence, shift),
        increment_covariance=variance[:, :, None] * np.eye(6),
        pixel_variance=noise.pixel**2,
        features=chosen,
        excluded=excluded,
        initial_pose=np.eye(4),
        initial_covariance=np.zeros((6, 6)),
        kernel=kernel,
        remarks=remarks,
    )
