"""The `calibrated` problem of a recording with one camera."""

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.problem import Excluded, Problem
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import HuberKernel, InputError

from ...conventions.extrinsics_check import unconfirmed_position
from ...odometry.monocular_odometry import monocular_odometry
from ...tracks.intrinsics_check import intrinsics_findings
from ...tracks.recording_faults import unusable
from ..findings import inertial_findings, inertial_repairs, scale_findings
from ..problem import imu_remarks, problem_of
from ..result import InertialDiagnosis
from ..units import imu_unit_findings, imu_units, require_si
from .initial_state import monocular_start
from .track_mask import repaired

SHORTEST = 3
"""observations of a track that is used: two rays intersect wherever the match is"""
TRACKS_AS_RECORDED = (
    "tracks are taken as recorded, without a mask but for those of fewer than three observations: wrong matches are "
    "left to kernel and gates"
)


def monocular_problem(found: InertialDiagnosis, features: int | None) -> Problem:
    """The problem of a diagnosed recording: tracks split and masked, samples in SI units and the axes of imu_T_cam.

    Raises InputError where no start is found.
    """
    sequence, start, tracks = found.sequence, found.monocular, found.tracks
    if start is None or tracks is None:
        raise InputError(f"{sequence.source or sequence.name}: {found.failure_reason or 'no start is found'}")
    remarks = (
        f"pixel noise {'estimated from the recording' if found.pixel_found else 'assumed'}: {found.pixel:.2f} px",
        *imu_remarks(sequence),
        f"scale: {start.remark}",
    )
    path = start.path(sequence.n_frames)
    excluded = tracks.excluded.copy()
    excluded[np.flatnonzero(excluded == Excluded.NO)[start.used]] = Excluded.START
    problem = problem_of(
        repaired(sequence, tracks), excluded, features, found.pixel, HuberKernel(), start.start, path, remarks
    )
    return replace(
        problem,
        inverse_depth_prior=start.depths,
        findings=inertial_findings(found, tracks),
        repairs=(*inertial_repairs(found), *tracks.repairs),
        diagnosed=found.pixel_found,
    )


def as_recorded_monocular(
    sequence: Sequence, features: int | None, pixel: float, kernel: HuberKernel | None
) -> Problem:
    """The problem of a recording taken as it is, with the noise of its calibration and `pixel` px.

    Raises InputError where no start is found, and for samples in other units than rad/s and m/s^2.
    """
    assert sequence.imu is not None
    source = sequence.source or sequence.name
    reason = unusable(sequence) or unconfirmed_position(sequence)
    if reason:
        raise InputError(f"{source}: {reason}")
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            require_si(sequence, imu_unit_findings(imu_units(sequence, monocular_odometry(sequence))))
            found = monocular_start(sequence, imu_intervals(sequence.imu, sequence.t))
    except ValueError as error:
        raise InputError(f"{source}: {error}") from error
    o = sequence.observations
    excluded = np.zeros(len(o), dtype=np.uint8)
    excluded[o.counts(sequence.n_landmarks)[o.landmark] < SHORTEST] = Excluded.SHORT
    excluded[(excluded == Excluded.NO) & found.used] = Excluded.START
    remarks = (
        f"not diagnosed: {pixel:g} px is assumed, not estimated from the recording",
        *imu_remarks(sequence),
        TRACKS_AS_RECORDED,
        f"scale: {found.remark}",
    )
    path = found.path(sequence.n_frames)
    return replace(
        problem_of(sequence, excluded, features, pixel, kernel, found.start, path, remarks),
        inverse_depth_prior=found.depths,
        findings=(*sequence.findings, *intrinsics_findings(sequence), *scale_findings(found)),
    )
