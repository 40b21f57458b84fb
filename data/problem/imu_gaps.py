"""Noise over gaps between inertial samples, from how much the samples change over as long a time elsewhere.

Interpolated over a gap of G seconds, a random walk of spectral density q errs by a Brownian bridge, whose integral has
q G^3 / 12 of variance. White noise of density s gives s^2 G, so s^2 grows by q G^2 / 12. q is the mean square of
x(t + G) - x(t) over G, less twice the variance of the noise, for the angular velocity and the specific force.
"""

import numpy as np

from fgbaseline.geometry import FloatArray

from ..imu import ImuSamples
from ..observations import IntArray

GAP = 0.1
"""s between samples, from which on an interval is a gap; so is one longer than `PERIODS` sample periods"""
PERIODS = 2.5


def sample_gaps(samples: ImuSamples) -> IntArray:
    """Indices (g,) of the samples that are followed by a gap."""
    longest = max(GAP, PERIODS * samples.period)
    return np.flatnonzero(np.diff(samples.t) > longest)


def interval_densities(samples: ImuSamples, frames: FloatArray) -> FloatArray:
    """Noise densities and walks (T-1, 4) of each interval between frames (T,), s: larger if a gap lies in it."""
    densities = np.tile(samples.noise.densities, (len(frames) - 1, 1))
    for i in sample_gaps(samples).tolist():
        start, end = float(samples.t[i]), float(samples.t[i + 1])
        covered = np.minimum(frames[1:], end) - np.maximum(frames[:-1], start)
        share = np.maximum(covered, 0.0) / np.diff(frames)
        excess = _change(samples, end - start) * (end - start) ** 2 / 12.0
        densities[:, [0, 2]] = np.sqrt(densities[:, [0, 2]] ** 2 + share[:, None] * excess)
    return densities


def _change(samples: ImuSamples, lag: float) -> FloatArray:
    """Spectral densities q (2,) of angular velocity and specific force, each the largest of its components."""
    steps = max(1, min(round(lag / samples.period), len(samples) - 1))
    straight = samples.t[steps:] - samples.t[:-steps] < 1.5 * steps * samples.period
    if not straight.any():
        straight[:] = True
    noise = samples.noise.densities[[0, 2]] ** 2 / samples.period
    sensors = (samples.angular_velocity, samples.specific_force)
    moved = [np.mean((x[steps:] - x[:-steps])[straight] ** 2, axis=0).max() for x in sensors]
    return np.maximum(np.array(moved) - 2.0 * noise, 0.0) / lag
