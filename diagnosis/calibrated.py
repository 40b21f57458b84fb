"""The `calibrated` preset: a repaired and masked recording with the estimated noise and without landmark priors."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fgbaseline.data.problem import NoiseSettings, Problem
from fgbaseline.data.problem.velocity_gaps import inflate_gap_covariance
from fgbaseline.data.sequence import Sequence, require_scale
from fgbaseline.data.velocity_increments import Shift, dead_reckoned_path, increments
from fgbaseline.data.wording import plural
from fgbaseline.geometry import HuberKernel, InputError

from .body_velocity.pipeline import diagnose
from .body_velocity.result import Diagnosis
from .findings.track_statistics import track_statistics
from .findings.velocity_findings import findings_of, rescalings
from .inertial.monocular.problem import as_recorded_monocular, monocular_problem
from .inertial.pipeline import diagnose_inertial
from .inertial.problem import as_recorded_inertial, inertial_problem
from .inertial.result import InertialDiagnosis
from .repair_overrides.applied_overrides import mask_settings, override_sentences, with_given_units, with_overrides
from .repair_overrides.settings import Repairs
from .repairs.repaired_sequence import repair
from .repairs.visual_dropouts import averaged_over_dropouts, dropout_intervals
from .tracks.observation_mask import MaskSettings, choose_features, exclusions


@dataclass(frozen=True, slots=True)
class AsRecordedSettings:
    """Settings of a problem whose recording is taken as recorded, without a diagnosis."""

    noise: NoiseSettings = field(default_factory=NoiseSettings)
    """with raw inertial samples only the pixel noise"""
    shift: float = Shift.AFTER
    """intervals after its stamp from which a velocity holds (`motion.zero_order_hold`); 0: that of frame k moves frame
    k to k + 1"""
    mask: MaskSettings = field(default_factory=MaskSettings)
    """not for one camera, whose tracks are masked by the diagnosis only"""
    kernel: HuberKernel | None = field(default_factory=HuberKernel)


def calibrated(
    sequence: Sequence,
    features: int | None = None,
    *,
    diagnosis: Diagnosis | InertialDiagnosis | None = None,
    settings: AsRecordedSettings | None = None,
    repairs: Repairs | None = None,
    processes: int = 1,
) -> Problem:
    """Estimation problem of a recording: diagnosed, repaired and masked, with the noise estimated from it.

    With `settings`, or where nothing can be estimated, the recording is taken as recorded. A `diagnosis` of the
    recording is used in place of a new one (`diagnose`, or `diagnose_inertial` for raw inertial samples). Values in
    `repairs` take precedence over it. `features` is the number of landmarks to keep, those observed most often after
    masking (None: all). The number of `processes` does not change the result.

    Body velocities: the first pose is fixed at the identity. The noise of an increment is the standard deviation of a
    velocity times dt; a fractional shift correlates the errors of neighboring increments, which is not modeled.

    Raw inertial samples: `Problem.imu` replaces the increments. `Problem.start` is the initial state that was
    estimated, with its covariance; roll and pitch are not fixed. The noise of the samples is as given with them, and
    that of the pixels is estimated.

    Raises InputError for impossible repairs, arguments that contradict each other or that the recording has no use for,
    units in doubt, and where no initial state is found.
    """
    require_scale(sequence)
    if settings is not None and diagnosis is not None:
        raise InputError("diagnosis: a recording that is taken as it is has none; give a diagnosis or settings")
    if sequence.imu is not None:
        return _inertial(sequence, features, diagnosis, settings, repairs, processes)
    if isinstance(diagnosis, InertialDiagnosis):
        raise InputError("diagnosis: it is one of raw inertial samples, and the recording has body velocities")
    if settings is not None and repairs is not None:
        raise InputError("repairs: a recording that is taken as it is has none; give repairs or settings, not both")
    if settings is None:
        diagnosis = with_given_units(diagnosis or diagnose(sequence, processes), repairs or Repairs())
        if diagnosis.units.doubt:
            raise InputError(f"{sequence.source or sequence.name}: {diagnosis.units.doubt}")
        sequence = diagnosis.sequence
        if diagnosis.sigmas is not None or repairs is not None:
            return _diagnosed(diagnosis, features, repairs or Repairs())
    problem = inflate_gap_covariance(_as_recorded(sequence, features, settings or AsRecordedSettings()))
    if diagnosis is None or not diagnosis.failure_reason:
        return problem
    return replace(
        problem,
        remarks=(f"not diagnosed: {diagnosis.failure_reason}", *problem.remarks),
        findings=findings_of(diagnosis),
        repairs=rescalings(diagnosis),
    )


def _inertial(
    sequence: Sequence,
    features: int | None,
    diagnosis: Diagnosis | InertialDiagnosis | None,
    settings: AsRecordedSettings | None,
    repairs: Repairs | None,
    processes: int,
) -> Problem:
    """Problem of a recording with raw inertial samples."""
    if repairs is not None:
        raise InputError("repairs: a recording with raw inertial samples has none that can be set; leave them out")
    if isinstance(diagnosis, Diagnosis):
        raise InputError("diagnosis: it is one of body velocities; raw inertial samples need `diagnose_inertial`")
    if diagnosis is not None and diagnosis.sequence.monocular != sequence.monocular:
        raise InputError("diagnosis: it is one of another number of cameras")
    if settings is not None and settings.shift != Shift.AFTER:
        raise InputError("settings: a shift is one of body velocities, and the recording has raw inertial samples")
    if sequence.monocular:
        if settings is not None:
            if settings.mask != MaskSettings():
                raise InputError("settings: a mask of one camera needs the diagnosis; leave the mask out")
            return as_recorded_monocular(sequence, features, settings.noise.pixel, settings.kernel)
        return monocular_problem(diagnosis or diagnose_inertial(sequence), features)
    if settings is not None:
        return as_recorded_inertial(sequence, features, settings.noise.pixel, settings.mask, settings.kernel)
    return inertial_problem(diagnosis or diagnose_inertial(sequence, processes), features)


def _diagnosed(found: Diagnosis, features: int | None, repairs: Repairs) -> Problem:
    diagnosis = with_overrides(found, repairs)
    mask, tracks = mask_settings(repairs)
    repaired = repair(diagnosis, mask, tracks)
    noise = diagnosis.sigmas or NoiseSettings()
    inflation = 1.0 if found.fit is None or repairs.sigma.pixel is not None else found.fit.inflation.pixel
    white = f" ({inflation:.1f} times the noise from frame to frame)" if inflation > 1.0 else ""
    remarks = (
        *((f"not diagnosed: {found.failure_reason}",) if found.failure_reason else ()),
        f"noise {_origin(found, repairs)}: {noise.pixel:.2f} px{white}, {noise.linear_velocity:.3f} m/s and "
        f"{noise.angular_velocity:.4f} rad/s",
    )
    problem = _velocity_problem(
        repaired.sequence, repaired.excluded, features, noise, diagnosis.shift, HuberKernel(), remarks
    )
    return replace(
        inflate_gap_covariance(_with_outlier_noise(_bridged(problem, diagnosis, noise), diagnosis)),
        pixel_inflation=inflation,
        diagnosed=not found.failure_reason,
        findings=findings_of(found, track_statistics(found, repaired if repairs == Repairs() else None)),
        repairs=(*override_sentences(repairs), *rescalings(found), *repaired.repairs),
    )


def _origin(found: Diagnosis, repairs: Repairs) -> str:
    given = len(repairs.sigma.model_dump(exclude_none=True))
    rest = "estimated from the recording" if found.sigmas is not None else "assumed, not estimated from the recording"
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
        f"in {plural(len(found.blind), 'interval')} with too few common landmarks, velocities are averaged over "
        f"neighboring intervals: their noise is {linear:.3f} m/s and {angular:.4f} rad/s there"
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


def _as_recorded(sequence: Sequence, features: int | None, settings: AsRecordedSettings) -> Problem:
    noise, shift = settings.noise, settings.shift
    excluded = exclusions(sequence, dead_reckoned_path(increments(sequence, shift)), settings.mask)
    remarks = (
        f"not diagnosed: {noise.pixel:g} px, {noise.linear_velocity:g} m/s and {noise.angular_velocity:g} rad/s are "
        "assumed, not estimated from the recording",
        _shift_remark(shift),
    )
    return _velocity_problem(sequence, excluded, features, noise, shift, settings.kernel, remarks)


def _shift_remark(shift: float) -> str:
    if shift == Shift.AFTER:
        return "velocities taken as recorded: the velocity of frame k moves frame k to k + 1"
    remark = f"velocities taken as recorded, shifted by {float(shift):+g} intervals"
    correlated = "" if float(shift).is_integer() else "; the correlation of neighboring increments is not modeled"
    return remark + correlated


def _velocity_problem(
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
