"""When was a velocity valid? The shift between velocities and images, from the turns that both show."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from fgbaseline.geometry import FloatArray

from ..observations import BoolArray

MAX_SHIFT = 3.0
"""frames"""
GRID = 0.02
"""frames"""
NOT_KNOWN = 0.2
"""frames: a standard error beyond which the shift is not identifiable"""
INFLATION = 2.0
"""of the standard error: residuals of neighbouring frames are correlated"""


@dataclass(frozen=True, slots=True)
class Timing:
    """The shift of the velocities."""

    shift: float
    """s: sample k, held for one interval, describes the motion from t_k + shift on; 0 is 'the interval after'"""
    deviation: float
    """s, its standard error"""
    identifiable: bool


def timing(seen: FloatArray, recorded: FloatArray, known: BoolArray, dt: float) -> Timing:
    """The shift at which `recorded` samples (T-1, c) follow best what the cameras see (T-1, c) over the intervals.

    Meant for rates: speed changes too slowly to tell. By the peak of their cross-correlation, which the noise of
    neither moves: a least-squares fit at a fractional shift would prefer the one that averages most noise away.
    Channels are weighted by their residuals.
    """
    k = np.arange(len(seen), dtype=np.float64)
    if known.sum() < 20:
        return Timing(0.0, np.inf, identifiable=False)
    spline = CubicSpline(k[known], seen[known] - seen[known].mean(axis=0), axis=0, extrapolate=False)
    near = np.interp(k, k[known], k[known]) - k
    inside = known & (np.abs(near) < 0.5)
    margin = int(np.ceil(MAX_SHIFT)) + 1
    inside[:margin] = inside[-margin:] = False
    x = recorded - recorded[inside].mean(axis=0)
    residual = x[inside] - spline(k[inside])
    sigma = np.maximum(1.4826 * np.median(np.abs(residual - np.median(residual, axis=0)), axis=0), 1e-9)
    weight = 1.0 / sigma**2
    shifts = np.arange(-MAX_SHIFT, MAX_SHIFT + GRID / 2, GRID)
    clipped = np.clip(x[inside], -6 * np.std(x[inside], axis=0), 6 * np.std(x[inside], axis=0))
    correlation = np.array([np.sum(weight * clipped * spline(k[inside] + shift)) for shift in shifts])
    peak = int(np.argmax(correlation - 0.5 * _energy(spline, k[inside], weight, shifts)))
    slope = spline(k[inside] + shifts[peak], 1)
    residual = x[inside] - spline(k[inside] + shifts[peak])
    sigma = np.maximum(1.4826 * np.median(np.abs(residual - np.median(residual, axis=0)), axis=0), 1e-9)
    # The slope squared of a noisy signal is too large; its curvature against the other signal is not.
    curvature = -float(np.sum(clipped * spline(k[inside] + shifts[peak], 2) / sigma**2))
    deviation = INFLATION * float(np.sqrt(np.sum(slope**2 / sigma**2))) / curvature if curvature > 0 else np.inf
    at_edge = peak in (0, len(shifts) - 1)
    return Timing(float(shifts[peak]) * dt, deviation * dt, bool(deviation < NOT_KNOWN and not at_edge))


def _energy(spline: CubicSpline, k: FloatArray, weight: FloatArray, shifts: FloatArray) -> FloatArray:
    """(m,) sum of squares about the mean of what the cameras see at k + shift: a window that takes in a stronger turn
    at one end correlates more there, whatever the shift is.

    Interpolated between whole shifts, where the noise in it is the same for all; between samples the spline has less.
    """
    whole = np.arange(-np.ceil(MAX_SHIFT), np.ceil(MAX_SHIFT) + 1.0)
    seen = np.array([spline(k + shift) for shift in whole])
    energy = np.sum(weight * (seen - seen.mean(axis=1, keepdims=True)) ** 2, axis=(1, 2))
    return np.asarray(CubicSpline(whole, energy)(shifts), dtype=np.float64)
