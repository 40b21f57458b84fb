"""Single inertial samples far from those around them: errors of transfer, and no motion of a body."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import noun, plural
from fgbaseline.geometry import FloatArray

from ..conventions.neighbor_deviation import FAR_BLIND, among_neighbors

NOUNS = {"angular_velocity": ("gyroscope", "rad/s"), "specific_force": ("accelerometer", "m/s^2")}


class Spikes(NamedTuple):
    """Samples of one sensor that were replaced."""

    sensor: str
    """field of `ImuSamples`"""
    samples: list[int]
    largest: float
    """distance from the samples around, in the sensor's unit"""


def without_spikes(sequence: Sequence) -> tuple[Sequence, tuple[Spikes, ...]]:
    """The recording with each spike of its samples interpolated between the two samples beside it.

    A shock is no spike: it is seen in at least two samples in succession.
    """
    imu, found = sequence.imu, []
    assert imu is not None
    for sensor in NOUNS:
        values: FloatArray = getattr(imu, sensor)
        usual, far = among_neighbors(values)
        spike = _alone(far > FAR_BLIND)
        if not spike.any():
            continue
        distance = np.linalg.norm(values - usual, axis=1)
        found.append(Spikes(sensor, np.flatnonzero(spike).tolist(), float(distance[spike].max())))
        good = np.flatnonzero(~spike)
        filled: Any = np.stack([np.interp(imu.t, imu.t[good], column[good]) for column in values.T], axis=1)
        imu = replace(imu, **{sensor: filled})
    return (replace(sequence, imu=imu), tuple(found)) if found else (sequence, ())


def _alone(far: BoolArray) -> BoolArray:
    """Mask (M,) of the samples that are far while neither neighbor is."""
    beside = np.convolve(far, [1, 0, 1], "same") > 0
    return np.asarray(far & ~beside, dtype=np.bool_)


def spike_findings(spikes: tuple[Spikes, ...]) -> tuple[Finding, ...]:
    """A finding for each sensor with spikes."""
    findings = []
    for sensor, samples, largest in spikes:
        name, unit = NOUNS[sensor]
        n = len(samples)
        which = ", ".join(map(str, samples[:4])) + (f" and {n - 4} more" if n > 4 else "")
        text = (
            f"{plural(n, 'single sample')} of the {name} {noun(n, 'is', 'are')} up to {largest:.3g} {unit} from those "
            f"around ({noun(n, 'sample')} {which}): replaced by an interpolation."
        )
        findings.append(Finding(f"{name}_spikes", text, n, 0, "samples", "counted"))
    return tuple(findings)
