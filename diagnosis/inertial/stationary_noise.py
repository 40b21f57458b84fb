"""Noise of the samples at rest, by the Allan deviation over a standing start."""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray

ENOUGH = 60.0
"""s of rest for an Allan deviation"""
WHITE = 1.0
"""s, averaging time at which the Allan deviation of white noise is its density"""
SHORT = 8
"""samples, the averaging that a shorter rest is judged by"""


class RestNoise(NamedTuple):
    """White noise of a rest."""

    duration: float
    """s"""
    gyroscope: float
    """rad/s/sqrt(Hz)"""
    accelerometer: float
    """m/s^2/sqrt(Hz)"""
    averaging: float
    """s, of the Allan deviation"""


def rest_noise(sequence: Sequence, duration: float) -> RestNoise | None:
    """The densities of the samples of a rest at the beginning of the recording; None with too few samples."""
    imu = sequence.imu
    assert imu is not None
    at = (imu.t >= sequence.t[0]) & (imu.t <= sequence.t[0] + duration)
    steps = round(WHITE / imu.period) if duration >= ENOUGH else SHORT
    if int(at.sum()) < 8 * steps:
        return None
    averaging = steps * imu.period
    densities = [
        float(np.median(allan_deviation(values[at], steps)) * np.sqrt(averaging))
        for values in (imu.angular_velocity, imu.specific_force)
    ]
    return RestNoise(duration, densities[0], densities[1], averaging)


def allan_deviation(values: FloatArray, steps: int) -> FloatArray:
    """Overlapping Allan deviations (c,) of samples (n, c), averaged over `steps` samples (Allan, 1966)."""
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    mean = (total[steps:] - total[:-steps]) / steps
    difference = mean[steps:] - mean[:-steps]
    return np.asarray(np.sqrt(0.5 * np.mean(difference**2, axis=0)), dtype=np.float64)
