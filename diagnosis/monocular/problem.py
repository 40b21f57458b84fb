"""The `calibrated` problem of a recording with one camera."""

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.finding import Finding
from fgbaseline.data.problem import Excluded, Problem
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import HuberKernel, InputError

from ..conventions.rig import doubt_of_position, is_far
from ..inertial.problem import imu_remarks, problem_of
from ..tracks.image_size import intrinsics_findings
from .start import EXCITED, MonocularStart, monocular_start

SHORTEST = 3
"""observations of a track that is used: two rays intersect wherever the match is"""
TRACKS_AS_RECORDED = (
    "tracks of one camera are taken as recorded, without a mask but for those of fewer than three observations: wrong "
    "matches are left to kernel and gates"
)
SAMPLES_AS_RECORDED = "units and axes of the inertial samples are taken as recorded: one camera does not check them"


def monocular_problem(
    sequence: Sequence, features: int | None, pixel: float | None, kernel: HuberKernel | None
) -> Problem:
    """The problem of a recording with one camera: samples and tracks as recorded, start and pixel noise found.

    `pixel` (px), where it is given, is taken in place of the noise that is found. Raises InputError where no start is
    found.
    """
    assert sequence.imu is not None
    if is_far(sequence):
        raise InputError(f"{sequence.source or sequence.name}: {doubt_of_position(sequence)}")
    imu = imu_intervals(sequence.imu, sequence.t)
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            found = monocular_start(sequence, imu)
    except ValueError as error:
        raise InputError(f"{sequence.source or sequence.name}: {error}") from error
    o = sequence.observations
    excluded = np.zeros(len(o), dtype=np.uint8)
    excluded[o.counts(sequence.n_landmarks)[o.landmark] < SHORTEST] = Excluded.SHORT
    noise = found.pixel if pixel is None else pixel
    origin = "estimated from the recording" if pixel is None and found.window is not None else "assumed"
    remarks = (
        f"pixel noise {origin}: {noise:.2f} px",
        *imu_remarks(sequence),
        TRACKS_AS_RECORDED,
        SAMPLES_AS_RECORDED,
        f"scale: {found.remark}",
    )
    return replace(
        problem_of(sequence, excluded, features, noise, kernel, found.start, found.path(sequence.n_frames), remarks),
        inverse_depth_prior=found.depths,
        findings=(*sequence.findings, *intrinsics_findings(sequence), *_scale_findings(found)),
        diagnosed=pixel is None and found.window is not None,
    )


def _scale_findings(found: MonocularStart) -> tuple[Finding, ...]:
    if found.excited:
        return ()
    share = np.inf if found.window is None else found.window.solution.scale_sigma
    sentence = found.remark[0].upper() + found.remark[1:] + "."
    return (Finding("scale_not_excited", sentence, share, share, "1", f"1-sigma, {EXCITED:g} is allowed"),)
