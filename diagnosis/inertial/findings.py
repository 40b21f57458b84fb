"""Findings on raw inertial data, in sentences."""

from dataclasses import replace

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.problem.imu_gaps import sample_gaps
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import capitalized, plural

from ..body_velocity.result import Diagnosis
from ..findings.track_findings import track_findings
from ..findings.track_statistics import TrackStatistics, track_statistics
from ..repairs.repaired_sequence import Repaired, RepairedTracks, TrackRepairs, repaired_tracks
from ..tracks.intrinsics_check import intrinsics_findings
from ..tracks.observation_mask import MaskSettings
from .baseline_unit import baseline_findings
from .imu_spikes import NOUNS, spike_findings
from .monocular.initial_state import EXCITED, MonocularStart
from .result import InertialDiagnosis
from .sensor_axes import axes_findings
from .sensor_findings import sensor_findings
from .units import imu_unit_findings

MIN_DROPPED = 0.001
"""share of the samples"""
DROPPED = 1.5
"""interval between samples, in sample periods, from which on a sample is missing"""


def inertial_findings(found: InertialDiagnosis, tracks: RepairedTracks | None = None) -> tuple[Finding, ...]:
    """Faults of the samples, then of the tracks; none for a clean recording. `tracks` are computed where not given."""
    lengths = () if found.recorded.monocular else baseline_findings(found.baseline, found.recorded)
    units = (*lengths, *imu_unit_findings(found.units))
    meaning = (*units, *axes_findings(found.axes))
    of_file = (*found.sequence.findings, *intrinsics_findings(found.sequence))
    findings = (*of_file, *meaning, *_gaps(found.sequence), *spike_findings(found.spikes))
    if found.sensors is not None:
        noise = found.recorded.imu.noise if found.recorded.imu is not None else None
        stated = None if noise is None else (noise.gyroscope_density, noise.accelerometer_density)
        findings += sensor_findings(found.sensors, stated)
    if found.odometry is None:
        return findings
    if found.monocular is not None:
        findings += scale_findings(found.monocular)
    return findings + track_findings(found.sequence, found.repeated, inertial_track_statistics(found, tracks))


def scale_findings(start: MonocularStart) -> tuple[Finding, ...]:
    """A finding where the motion of one camera does not determine its scale."""
    if start.excited:
        return ()
    share = np.inf if start.window is None else start.window.solution.scale_sigma
    sentence = f"{capitalized(start.remark)}."
    return (Finding("scale_not_excited", sentence, share, share, "1", f"1-sigma, {EXCITED:g} is allowed"),)


def inertial_track_statistics(found: InertialDiagnosis, tracks: RepairedTracks | None = None) -> TrackStatistics:
    """Statistics of the tracks, before and after the mask."""
    sequence = found.sequence
    alone, tracks = Diagnosis(sequence, odometry=found.odometry, repeated=found.repeated), tracks or found.tracks
    if tracks is None:
        if found.path is None:
            return track_statistics(replace(alone, odometry=None))
        tracks = repaired_tracks(sequence, found.path.states.pose, MaskSettings(), TrackRepairs(), found.pixel)
    masked = replace(sequence, observations=tracks.observations, n_landmarks=tracks.n_landmarks, truth=None)
    return track_statistics(alone, Repaired(masked, tracks.excluded, tracks.gate, tracks.repairs))


def inertial_repairs(found: InertialDiagnosis) -> tuple[str, ...]:
    """Repairs of the samples, one sentence each."""
    named = (("angular velocities", found.units.rate), ("specific forces", found.units.force))
    done = [f"{name} of the inertial samples multiplied by {factor:.6g}" for name, factor in named if factor != 1.0]
    lengths = (("baseline", found.baseline.factor), ("translation of imu_T_cam", found.baseline.extrinsic))
    done += [f"{name} multiplied by {factor:.6g}" for name, factor in lengths if factor != 1.0]
    done += [f"{plural(len(s.samples), 'spike')} of the {NOUNS[s.sensor][0]} interpolated" for s in found.spikes]
    if found.axes.changed:
        done.append("inertial samples turned from the axes they were recorded in to those of imu_T_cam")
    return tuple(done)


def _gaps(sequence: Sequence) -> tuple[Finding, ...]:
    """Gaps between samples, and single samples that are missing."""
    imu = sequence.imu
    assert imu is not None
    step, gaps = np.diff(imu.t), sample_gaps(imu)
    findings = []
    if len(gaps):
        longest = int(gaps[np.argmax(step[gaps])])
        text = (
            f"{plural(len(gaps), 'gap')} between inertial samples, the longest {step[longest]:.3g} s from "
            f"{imu.t[longest]:.6f} s on: nothing is measured there, and the uncertainty grows."
        )
        findings.append(Finding("imu_gaps", text, len(gaps), len(gaps), "gaps", "counted"))
    short = step[np.setdiff1d(np.arange(len(step)), gaps)]
    missing = int(np.sum(np.round(short[short > DROPPED * imu.period] / imu.period) - 1))
    if missing > MIN_DROPPED * len(imu):
        text = (
            f"{missing:,} inertial samples are missing beside {len(imu):,} (intervals above {DROPPED:g} times the "
            f"median, {1e3 * imu.period:.3g} ms): they are interpolated."
        )
        findings.append(Finding("dropped_samples", text, missing, missing, "samples", "counted"))
    return tuple(findings)
