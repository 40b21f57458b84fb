"""Raw inertial samples given to the tracks of a recording, in place of its velocities."""

from dataclasses import replace

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...finding import Finding
from ...observations import BoolArray, Observations
from ...sequence import Sequence
from ...wording import per_cent, plural
from ..files.file_errors import FilePath
from .imu_csv import read_imu_csv
from .imu_samples import RawSamples
from .imu_yaml import ImuCalibration

MIN_FRAMES = 2
FACTORS = (1.0, 1e-3, 1e-6, 1e-9, 1e3, 1e6, 1e9)
"""factors for stamps of samples in another unit than those of the frames"""
LONGEST_PERIOD, USUAL_PERIOD = 1.5, 0.5
"""intervals between frames: samples in the unit of the frames, and in another unit, have at most this period"""
COVERED = 0.5
"""share of the frames that samples in another unit must cover"""


def read_imu(samples: FilePath, calibration: ImuCalibration) -> RawSamples:
    """The samples of a CSV with the noise of a calibration, and the remarks of both. Raises as `read_imu_csv`."""
    raw = read_imu_csv(samples, calibration.noise, calibration.gravity)
    return raw._replace(remarks=(*calibration.remarks, *raw.remarks))


def attach_imu(sequence: Sequence, raw: RawSamples, source: str, *, velocities: bool = True) -> Sequence:
    """The recording with these samples in place of its velocities.

    Stamps of the samples in another unit than those of the frames are converted. Frames farther than a sample period
    outside the samples are cut and counted. Raises InputError where fewer than two frames are left. `velocities` is
    whether the recording has its own, which are then reported as ignored.
    """
    factor = _unit_factor(sequence.t, raw.samples.t)
    imu = raw.samples if factor == 1.0 else replace(raw.samples, t=raw.samples.t * factor)
    inside = _inside(sequence.t, imu.t)
    first, last, begin, end = map(float, (sequence.t[0], sequence.t[-1], imu.t[0], imu.t[-1]))
    ranges = f"the frames are from {first!r} to {last!r} s and the inertial samples from {begin!r} to {end!r} s"
    if int(inside.sum()) < MIN_FRAMES:
        raise InputError(
            f"imu_time_stamps: {ranges}, so that {plural(int(inside.sum()), 'frame')} of {len(inside)} can be used; "
            "give the samples of this recording, on its clock"
        )
    remarks, findings = [*sequence.remarks, *raw.remarks], [*sequence.findings, *raw.findings]
    if factor != 1.0:
        text = f"The stamps of samples are in another unit than those of the frames: multiplied by {factor:g}."
        certainty = f"so multiplied they cover {per_cent(float(inside.mean()))} of the frames"
        findings.append(Finding("imu_time_unit", text, 1.0 / factor, 1.0, "recorded over true", certainty))
    if velocities:
        remarks.append(f"The velocities of the recording are ignored: the motion is from the samples of {source}.")
    cut = int((~inside).sum())
    if cut:
        text = f"{plural(cut, 'frame')} of {len(inside)} lie outside the inertial samples and are cut: {ranges}."
        findings.append(Finding("frames_without_samples", text, cut, 0, "frames", "counted"))
        sequence = _of_frames(sequence, inside)
    empty = np.empty((0, 3))
    return replace(
        sequence,
        linear_velocity=empty,
        angular_velocity=empty,
        imu=imu,
        remarks=tuple(remarks),
        findings=tuple(findings),
    )


def _inside(t: FloatArray, samples: FloatArray) -> BoolArray:
    """Mask (T,) of the frames that are at most a sample period outside the samples (M,)."""
    period = float(np.median(np.diff(samples)))
    return np.asarray((t >= samples[0] - period) & (t <= samples[-1] + period), dtype=np.bool_)


def _unit_factor(t: FloatArray, samples: FloatArray) -> float:
    """Factor from the stamps of samples (M,) to the unit of frames (T,): 1, unless only another unit fits them."""
    if len(t) < MIN_FRAMES:
        return 1.0
    period = float(np.median(np.diff(samples)) / np.median(np.diff(t)))
    covered = {
        factor: float(_inside(t, factor * samples).mean())
        for factor in FACTORS
        if factor * period <= (LONGEST_PERIOD if factor == 1.0 else USUAL_PERIOD)
    }
    best = max(covered, key=lambda factor: covered[factor], default=1.0)
    as_given = covered.get(1.0, 0.0)
    return best if covered.get(best, 0.0) >= max(COVERED, 2.0 * as_given) else 1.0


def _of_frames(sequence: Sequence, kept: BoolArray) -> Sequence:
    """The recording with some of its frames (T,), numbered anew."""
    o, number = sequence.observations, np.cumsum(kept) - 1
    chosen = kept[o.frame]
    recorded = np.delete(np.arange(len(kept) + len(sequence.left_out)), list(sequence.left_out))
    bodies = {name: getattr(sequence, name) for name in ("linear_velocity", "angular_velocity")}
    return replace(
        sequence,
        t=sequence.t[kept],
        **{name: values[kept] if len(values) else values for name, values in bodies.items()},
        observations=Observations(number[o.frame[chosen]], o.landmark[chosen], o.pixel[chosen]),
        truth=None if sequence.truth is None else sequence.truth.of_frames(kept),
        left_out=tuple(sorted({*sequence.left_out, *recorded[~kept].tolist()})),
    )
