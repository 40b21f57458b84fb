"""Time shift between velocities and images, by cross-correlation of angular velocities."""

from dataclasses import dataclass, field

import numpy as np

from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray

from ..robust_constants import MAD_TO_SIGMA
from .spline import Spline, spline_through

MAX_SHIFT = 3.0
"""frames"""
MIN_LEAD = 5.0
"""log-likelihood by which the shift must lead those more than an interval away"""
LONGEST_GAP = 2
"""intervals; longer gaps in the odometry are not interpolated"""
SHIFT_STEP = 0.02
"""frames"""
MAX_STANDARD_ERROR = 0.2
"""frames: a standard error beyond which the shift is not identifiable"""
STANDARD_ERROR_FACTOR = 2.0
"""factor on the standard error, since residuals of neighboring frames are correlated"""


@dataclass(frozen=True, eq=False, slots=True)
class VelocityTimeOffset:
    """Estimated time shift of the velocities; negative where they lag the images."""

    shift: float
    """s: sample k, held for one interval, describes the motion from t_k + shift on; 0 is 'the interval after'"""
    deviation: float
    """s, its standard error"""
    identifiable: bool
    shifts: FloatArray = field(default_factory=lambda: np.empty(0))
    """(m,) intervals: those tried"""
    agreement: FloatArray = field(default_factory=lambda: np.empty(0))
    """(m,) score at each, 1 at most: of cross-correlation and energy, or the relative likelihood of windows"""


def timing(seen: FloatArray, recorded: FloatArray, known: BoolArray, dt: float) -> VelocityTimeOffset:
    """Time shift that maximizes the likelihood of samples `recorded` (T-1, c) given odometry `seen` (T-1, c), rad/s.

    Meant for angular rates, since speed changes too slowly. The peak of the cross-correlation is unbiased by noise; a
    least-squares fit at a fractional shift would prefer the shift that averages most noise. Channels are weighted by
    their residuals.
    """
    k = np.arange(len(seen), dtype=np.float64)
    if known.sum() < 20:
        return VelocityTimeOffset(0.0, np.inf, identifiable=False)
    inside = known & _surrounded(known)
    if inside.sum() < 20:
        return VelocityTimeOffset(0.0, np.inf, identifiable=False)
    spline = spline_through(k[known], _moderate(seen, recorded, known))
    x = recorded - recorded[inside].mean(axis=0)
    residual = x[inside] - spline(k[inside])
    sigma = np.maximum(MAD_TO_SIGMA * np.median(np.abs(residual - np.median(residual, axis=0)), axis=0), 1e-9)
    weight = 1.0 / sigma**2
    shifts = np.arange(-MAX_SHIFT, MAX_SHIFT + SHIFT_STEP / 2, SHIFT_STEP)
    clipped = np.clip(x[inside], -6 * np.std(x[inside], axis=0), 6 * np.std(x[inside], axis=0))
    correlation = np.array([np.sum(weight * clipped * spline(k[inside] + shift)) for shift in shifts])
    energy = _energy(spline, k[inside], weight, shifts)
    score = correlation - 0.5 * energy
    peak = int(np.argmax(score))
    slope = spline(k[inside] + shifts[peak], 1)
    residual = x[inside] - spline(k[inside] + shifts[peak])
    sigma = np.maximum(MAD_TO_SIGMA * np.median(np.abs(residual - np.median(residual, axis=0)), axis=0), 1e-9)
    # Sandwich standard error (White 1980), outliers included, with the observed curvature as the information. The
    # squared slope of a noisy signal overestimates it.
    pull = (residual - np.median(residual, axis=0)) * slope / sigma**2
    curvature = -float(np.sum(clipped * spline(k[inside] + shifts[peak], 2) / sigma**2))
    deviation = STANDARD_ERROR_FACTOR * float(np.sqrt(np.sum(pull**2))) / curvature if curvature > 0 else np.inf
    at_edge = peak in (0, len(shifts) - 1)
    lead = float(score[peak] - score[np.abs(shifts - shifts[peak]) > 1.0].max())
    identifiable = bool(deviation < MAX_STANDARD_ERROR and lead > MIN_LEAD and not at_edge)
    return VelocityTimeOffset(float(shifts[peak]) * dt, deviation * dt, identifiable, shifts, 2.0 * score / energy)


def _surrounded(known: BoolArray) -> BoolArray:
    """Mask (n,) of the intervals that have neither a long gap nor an end within the largest shift."""
    margin = int(np.ceil(MAX_SHIFT)) + 1
    edges = np.flatnonzero(np.diff(np.concatenate([[True], known, [True]]).astype(np.int8)))
    good = np.ones(len(known), dtype=np.bool_)
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start > LONGEST_GAP or start == 0 or end == len(known):
            good[max(0, start - margin) : end + margin] = False
    good[:margin] = good[-margin:] = False
    return good


def _moderate(seen: FloatArray, recorded: FloatArray, known: BoolArray) -> FloatArray:
    """Odometry (m, c) at the known intervals, centered and clipped to the range of the velocities."""
    x = recorded[known] - np.median(recorded[known], axis=0)
    y = seen[known] - np.median(seen[known], axis=0)
    reach = np.abs(x).max(axis=0) + 3.0 * MAD_TO_SIGMA * np.median(np.abs(y - x), axis=0)
    y = np.clip(y, -reach, reach)
    return np.asarray(y - y.mean(axis=0), dtype=np.float64)


def _energy(spline: Spline, k: FloatArray, weight: FloatArray, shifts: FloatArray) -> FloatArray:
    """Sum of squares (m,) about the mean of the odometry at k + shift.

    It normalizes the correlation: a window that includes a stronger turn correlates more at any shift. Interpolated
    between integer shifts, where its noise is constant; between samples the spline has less.
    """
    whole = np.arange(-np.ceil(MAX_SHIFT), np.ceil(MAX_SHIFT) + 1.0)
    seen = np.array([spline(k + shift) for shift in whole])
    energy = np.sum(weight * (seen - seen.mean(axis=1, keepdims=True)) ** 2, axis=(1, 2))
    return spline_through(whole, energy)(shifts)
