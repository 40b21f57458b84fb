"""The `calibrated` problem of a recording with raw inertial samples."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fgbaseline.data.problem import Problem
from fgbaseline.data.problem.imu_gaps import sample_gaps
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray, HuberKernel, InputError

from ..conventions.extrinsics_check import usual_rig
from ..inertial_initialization.initial_state import Start
from ..odometry.stereo_odometry import Odometry, odometry
from ..repairs.repaired_sequence import TrackRepairs, repaired_tracks, truth_of_landmarks
from ..tracks.observation_mask import MaskSettings, choose_features, exclusions
from ..tracks.recording_faults import unusable
from .baseline_unit import BaselineUnit, baseline_findings, baseline_unit
from .findings import inertial_findings, inertial_repairs
from .pipeline import found_start
from .result import InertialDiagnosis
from .sensor_axes import in_imu_axes, sensor_axes
from .truth_alignment import path_from, tied_truth
from .units import imu_unit_findings, imu_units, require_si, rescaled_samples


def inertial_problem(found: InertialDiagnosis, features: int | None) -> Problem:
    """The problem of a diagnosed recording: tracks split and masked, samples in SI units, noise of the IMU as given.

    Raises InputError where no start is found.
    """
    sequence = found.sequence
    if found.start is None or found.path is None:
        raise InputError(f"{_source(sequence)}: {found.failure_reason or 'no start is found'}")
    path = found.path.states.pose
    tracks = repaired_tracks(sequence, path, MaskSettings(), TrackRepairs(), found.pixel)
    repaired = replace(
        sequence,
        observations=tracks.observations,
        n_landmarks=tracks.n_landmarks,
        truth=truth_of_landmarks(sequence.truth, tracks.n_landmarks),
    )
    origin = "estimated from the recording" if found.fit is not None else "assumed, not estimated from the recording"
    remarks = (f"pixel noise {origin}: {found.pixel:.2f} px", *imu_remarks(sequence))
    problem = problem_of(repaired, tracks.excluded, features, found.pixel, HuberKernel(), found.start, path, remarks)
    return replace(
        problem,
        diagnosed=True,
        findings=inertial_findings(found, tracks),
        repairs=(*inertial_repairs(found), *tracks.repairs),
    )


def as_recorded_inertial(
    sequence: Sequence, features: int | None, pixel: float, mask: MaskSettings, kernel: HuberKernel | None
) -> Problem:
    """The problem of a recording taken as it is, with the noise of its calibration and `pixel` px.

    Raises InputError where no start is found, and for samples and a baseline in other units than rad/s, m/s^2 and m.
    """
    reason = unusable(sequence)
    if reason:
        raise InputError(f"{_source(sequence)}: {reason}")
    usual = usual_rig(sequence)
    with threadpool_limits(limits=1, user_api="blas"):
        seen = odometry(usual)
    units = imu_units(sequence, seen)
    baseline = _baseline_unit(rescaled_samples(sequence, units), seen)
    require_si(sequence, (*baseline_findings(baseline, sequence), *imu_unit_findings(units)))
    if baseline.doubt:
        raise InputError(f"{_source(sequence)}: {baseline.doubt}")
    try:
        start, path = found_start(sequence, pixel, seen if usual is sequence else None)
    except ValueError as error:
        raise InputError(f"{_source(sequence)}: {error}") from error
    excluded = exclusions(sequence, path.states.pose, mask)
    remarks = (
        f"not diagnosed: {pixel:g} px is assumed, not estimated from the recording",
        *imu_remarks(sequence),
    )
    return problem_of(sequence, excluded, features, pixel, kernel, start, path.states.pose, remarks)


def _baseline_unit(sequence: Sequence, seen: Odometry) -> BaselineUnit:
    """The unit of the baseline, with the samples (in SI units) turned to the axes that the cameras show."""
    return baseline_unit(in_imu_axes(sequence, sensor_axes(sequence, seen)), seen)


def _source(sequence: Sequence) -> str:
    return sequence.source or sequence.name


def imu_remarks(sequence: Sequence) -> tuple[str, ...]:
    """Sentences on noise and gaps of the inertial samples."""
    imu = sequence.imu
    assert imu is not None
    n = imu.noise
    remarks = [
        f"noise of the inertial samples as given: gyroscope {n.gyroscope_density:.3g} rad/s/sqrt(Hz), walk "
        f"{n.gyroscope_walk:.3g}; accelerometer {n.accelerometer_density:.3g} m/s^2/sqrt(Hz), walk "
        f"{n.accelerometer_walk:.3g}; gravity {imu.gravity:g} m/s^2"
    ]
    gaps = sample_gaps(imu)
    if len(gaps):
        longest = float(np.diff(imu.t)[gaps].max())
        remarks.append(
            f"over {plural(len(gaps), 'gap')} between inertial samples (the longest {longest:.3g} s) they are "
            "interpolated, and their noise is that of as long a time elsewhere"
        )
    return tuple(remarks)


def problem_of(
    sequence: Sequence,
    excluded: NDArray[np.uint8],
    features: int | None,
    pixel: float,
    kernel: HuberKernel | None,
    start: Start,
    path: FloatArray,
    remarks: tuple[str, ...],
) -> Problem:
    """The problem from its parts; the truth is tied to `path` (T, 4, 4), where that is known."""
    assert sequence.imu is not None
    imu = imu_intervals(sequence.imu, sequence.t)
    chosen, excluded = choose_features(sequence, excluded, features)
    remarks = (*remarks, f"start: {start.state.source}")
    if sequence.truth is not None:
        truth, how = tied_truth(sequence.truth, path_from(start.pose, path), 1.0 / float(np.median(sequence.dt)))
        sequence, remarks = replace(sequence, truth=truth), (*remarks, how)
    sequence = replace(sequence, up_imu=start.pose[2, :3].copy())
    return Problem(
        preset="calibrated",
        findings=sequence.findings,
        sequence=sequence,
        increment=np.empty((0, 6)),
        increment_covariance=np.empty((0, 6, 6)),
        pixel_variance=pixel**2,
        features=chosen,
        excluded=excluded,
        initial_pose=start.pose,
        initial_covariance=np.asarray(start.state.covariance[:6, :6], dtype=np.float64),
        imu=imu,
        start=start.state,
        kernel=kernel,
        remarks=remarks,
    )
