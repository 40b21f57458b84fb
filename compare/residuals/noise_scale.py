"""Noise scale: estimated over modeled standard deviation of pixel and motion noise (expected 1)."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammainc, gammaincc

from fgbaseline.data import Estimate, Problem
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.stereo_camera import PIXEL_COMPONENTS

from .cost import motion_degrees, motion_squares, pixel_squares, prior_squares
from .reprojection import reprojection

RANGE = (1e-9, 1e9)
"""interval of the search for a scale"""


def pixel_scale(problem: Problem, estimate: Estimate) -> float:
    """Scale s of Gaussian pixel noise, in sigmas of the model, estimated from the residuals of used observations.

    At s the expected sum of kernel-weighted whitened squares equals the observed sum. A whitened residual is taken as
    Gaussian over its r rows with the variance s^2 (1 - h), where the leverage h of the estimated parameters has two
    parts. That of a landmark is 3 / (r n) in a track of n observations (zero with a prior). That of the poses follows
    from the squares of motion and priors: in linear least squares, the expected squares of pixels, motion and priors
    add up to r n - 3 m for n observations of m landmarks without a prior (r n with one), so the observed squares of
    motion and priors reduce those of the pixels. NaN for a NaN residual or without degrees of freedom, infinite for an
    infinite residual.
    """
    table = reprojection(problem.sequence, estimate)
    table = table[table["used"]]
    squared = pixel_squares(problem, table[list(PIXEL_COMPONENTS)].to_numpy())
    threshold = None if problem.kernel is None else problem.kernel.threshold
    observed = float(np.sum(problem.measurement.weighted(squared)))
    if not np.isfinite(observed):
        return observed
    _, track, seen = np.unique(table["landmark"].to_numpy(), return_inverse=True, return_counts=True)
    prior, rows = problem.landmark_prior is not None, problem.measurement.n_rows
    freedom = np.ones(len(table)) if prior else np.maximum(1.0 - 3.0 / (rows * seen[track]), 0.0)
    kept = np.minimum(motion_squares(problem, estimate), float(motion_degrees(problem))).sum()
    if prior:
        kept += min(prior_squares(problem, estimate, estimate.used), 3.0 * len(seen))
    freedom *= max(0.0, 1.0 - kept / max(rows * freedom.sum(), 1.0))
    if not freedom.sum() > 0.0:
        return float("nan")
    width, count = np.unique(np.sqrt(freedom), return_counts=True)

    def excess(log_scale: float) -> float:
        return float(count @ expected_square(np.exp(log_scale) * width, threshold, rows)) - observed

    low, high = np.log(RANGE)
    if not excess(low) < 0.0 < excess(high):
        return 0.0 if observed == 0.0 else float("inf")
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if excess(middle) > 0.0 else (middle, high)
    return float(np.exp(middle))


def motion_scale(problem: Problem, estimate: Estimate) -> float:
    """RMS of the whitened motion residuals per degree of freedom (expected at most 1, as poses also fit the pixels)."""
    return float(np.sqrt(np.mean(motion_squares(problem, estimate)) / motion_degrees(problem)))


def expected_square(scale: ArrayLike, threshold: float | None, rows: int = 3) -> FloatArray:
    """Expectation of `HuberKernel.weighted` for 3 or 2 independent Gaussian rows of standard deviation `scale` (...,).

    With x = norm / scale, which is chi-distributed with r = `rows` degrees of freedom, and c = threshold / scale:
    scale^2 E[x^2; x < c] + threshold scale E[x; x >= c].
    """
    s = np.asarray(scale, dtype=np.float64)
    if threshold is None:
        return np.asarray(rows * s**2)
    with np.errstate(divide="ignore", over="ignore"):
        half = 0.5 * (threshold / s) ** 2
    if rows == 3:
        mean, beyond = (
            np.sqrt(8.0 / np.pi),
            np.where(half < 700.0, (half + 1.0) * np.exp(-np.minimum(half, 700.0)), 0.0),
        )
    else:
        mean, beyond = np.sqrt(0.5 * np.pi), gammaincc(1.5, half)
    return np.asarray(rows * s**2 * gammainc(0.5 * rows + 1.0, half) + threshold * s * mean * beyond)
