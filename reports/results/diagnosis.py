"""Result of a diagnosis as terminal, page and files have it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fgbaseline.data import Sequence
from fgbaseline.data.finding import Finding
from fgbaseline.data.wording import plural
from fgbaseline.diagnosis import (
    Diagnosis,
    TrackStatistics,
    diagnose_inertial,
    findings_of,
    inertial_findings,
    inertial_sentences,
    inertial_to_json,
    not_identifiable,
    to_json,
    track_statistics,
)

NOT_BY_ONE_CAMERA = (
    "The magnitude of gravity, the scale of the accelerometer and the unit of the translation of imu_T_cam: one camera "
    "measures no length.",
    "Wrong matches and moving objects within their epipolar planes: they are left to kernel and gates.",
)


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """Result of a diagnosis as terminal, page and files have it."""

    sequence: Sequence
    counts: str
    """frames, observations and tracks, in words"""
    measured: str
    """source of the motion: body velocities or inertial samples"""
    document: dict[str, Any]
    """content of diagnosis.json"""
    findings: tuple[Finding, ...]
    undecided: str
    """why there is no diagnosis; empty where there is one"""
    not_identifiable: tuple[str, ...]
    sentences: tuple[str, ...]
    """on noise and motion"""
    diagnosis: Diagnosis | None = None
    """None of raw inertial samples"""
    tracks: TrackStatistics | None = None

    @property
    def verdict(self) -> list[str]:
        """Number of faults, or why it is unknown."""
        if self.undecided:
            return [f"The {self.measured} cannot be diagnosed: {self.undecided}."]
        return [f"{plural(len(self.findings), 'fault')} detected." if self.findings else "No fault detected."]


def found_by(diagnosis: Diagnosis) -> Found:
    """Result of the diagnosis of a recording with body velocities."""
    tracks = track_statistics(diagnosis)
    findings = findings_of(diagnosis, tracks)
    return Found(
        sequence=diagnosis.sequence,
        counts=_counts(diagnosis.sequence),
        measured="velocities",
        document=to_json(diagnosis, tracks, findings),
        findings=findings,
        undecided=diagnosis.failure_reason,
        not_identifiable=() if diagnosis.failure_reason else tuple(not_identifiable(diagnosis)),
        sentences=() if diagnosis.fit is None else (_noise(diagnosis),),
        diagnosis=diagnosis,
        tracks=tracks,
    )


def found_of_inertial(sequence: Sequence) -> Found:
    """Diagnosis of a recording with raw inertial samples."""
    diagnosis = diagnose_inertial(sequence)
    findings, read = inertial_findings(diagnosis), diagnosis.sequence
    return Found(
        sequence=read,
        counts=f"{_counts(read)}, {plural(len(read.imu or ()), 'inertial sample')}",
        measured="inertial samples",
        document=inertial_to_json(diagnosis, findings),
        findings=findings,
        undecided=diagnosis.failure_reason,
        not_identifiable=NOT_BY_ONE_CAMERA if read.monocular and not diagnosis.failure_reason else (),
        sentences=(*sequence.remarks, *inertial_sentences(diagnosis)),
    )


def _counts(sequence: Sequence) -> str:
    o = sequence.observations
    return (
        f"{plural(sequence.n_frames, 'frame')}, {plural(len(o), 'observation')} of "
        f"{plural(len(np.unique(o.landmark)), 'track')}"
    )


def _noise(diagnosis: Diagnosis) -> str:
    """Sentences on the estimated noise and its inflation."""
    fit = diagnosis.fit
    assert fit is not None
    sigma, white = fit.sigmas, fit.white
    text = (
        f"Noise (1-sigma): {sigma.linear_velocity:.3f} m/s and {sigma.angular_velocity:.4f} rad/s for each axis of the "
        f"velocity between two frames, "
    )
    if fit.inflation.pixel > 1.0:
        text += (
            f"{white.pixel:.2f} px for a pixel coordinate from frame to frame. The estimators use {sigma.pixel:.2f} "
            f"px, {fit.inflation.pixel:.1f} times as much, because the errors of a track are correlated in time."
        )
    else:
        text += f"{sigma.pixel:.2f} px for a pixel coordinate."
    if fit.inflation.velocity > 1.0:
        text += f" Velocity sigma: inflated by a factor of {fit.inflation.velocity:.1f} for time-correlated errors."
    return text
