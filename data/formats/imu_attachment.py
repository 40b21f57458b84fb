"""Raw inertial samples given to the tracks of a recording, in place of its velocities."""

from dataclasses import replace

import numpy as np

from fgbaseline.geometry import InputError

from ..finding import Finding
from ..observations import BoolArray, Observations
from ..plural import plural
from ..sequence import Sequence
from .imu_csv import read_imu_csv
from .imu_samples import RawSamples
from .imu_yaml import ImuCalibration
from .named_file import FilePath

MIN_FRAMES = 2


def read_imu(samples: FilePath, calibration: ImuCalibration) -> RawSamples:
    """The samples of a CSV with the noise of a calibration, and the remarks of both. Raises as `read_imu_csv`."""
    raw = read_imu_csv(samples, calibration.noise, calibration.gravity)
    return raw._replace(remarks=(*calibration.remarks, *raw.remarks))


def attach_imu(sequence: Sequence, raw: RawSamples, source: str, *, velocities: bool = True) -> Sequence:
    """The recording with these samples in place of its velocities.

    Frames farther than a sample period outside the samples are cut and counted. Raises InputError where fewer than two
    frames are left. `velocities` is whether the recording has its own, which are then reported as ignored.
    """
    imu = raw.samples
    period = imu.period
    inside = np.asarray((sequence.t >= imu.t[0] - period) & (sequence.t <= imu.t[-1] + period), dtype=np.bool_)
    first, last, begin, end = map(float, (sequence.t[0], sequence.t[-1], imu.t[0], imu.t[-1]))
    ranges = f"the frames are from {first!r} to {last!r} s and the inertial samples from {begin!r} to {end!r} s"
    if int(inside.sum()) < MIN_FRAMES:
        raise InputError(
            f"imu_time_stamps: {ranges}, so that {plural(int(inside.sum()), 'frame')} of {len(inside)} can be used; "
            "give the samples of this recording, on its clock"
        )
    remarks, findings = [*sequence.remarks, *raw.remarks], [*sequence.findings, *raw.findings]
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
