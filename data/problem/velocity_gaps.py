"""Process noise over gaps between frames, from the variation of the velocity elsewhere.

The velocity is modeled as a random walk of spectral density q (m^2/s^3 or rad^2/s^3). Held over a time t, its error has
the variance q t, and the increment q t^3 / 3. q comes from the structure function of the recorded velocities: the mean
square of u(s + t) - u(s), minus twice the noise variance, over t. The largest value over t is used, because a steady
acceleration shows only at long lags.
"""

from dataclasses import replace

import numpy as np

from fgbaseline.geometry import FloatArray, se3

from ..observations import BoolArray
from .definition import Problem

GAP = 2.5
"""interval of a gap, in median intervals"""
SHORTEST_LAG = 1.0
"""shortest lag, s; over less, noise hides the variation of the velocity"""
LAGS = 12
MIN_PAIRS = 5


def gaps(dt: FloatArray) -> BoolArray:
    """Mask (T-1,) of the intervals longer than `GAP` times the median."""
    return np.asarray(dt > GAP * np.median(dt), dtype=np.bool_)


def inflate_gap_covariance(problem: Problem) -> Problem:
    """Problem with the increment covariance over gaps inflated by the random walk of the velocity.

    A problem without gaps is returned unchanged.
    """
    dt = problem.sequence.dt
    long = gaps(dt)
    if not long.any() or long.all():
        return problem
    density = random_walk_density(problem, long)
    covariance = problem.increment_covariance.copy()
    J = se3.right_jacobian(problem.increment[long])
    strayed = (density * dt[long, None] ** 3 / 3.0)[:, :, None] * np.eye(6)
    covariance[long] += J @ strayed @ np.swapaxes(J, 1, 2)
    deviation = np.sqrt(np.einsum("nii->ni", covariance[long]))
    remark = (
        f"in the gaps between frames ({int(long.sum())}, the longest {dt[long].max():.3g} s) the velocity may have "
        f"changed as it does elsewhere: up to {np.linalg.norm(deviation[:, :3], axis=1).max():.2g} m and "
        f"{np.degrees(np.linalg.norm(deviation[:, 3:], axis=1).max()):.2g}° are allowed for"
    )
    return replace(problem, increment_covariance=covariance, remarks=(*problem.remarks, remark))


def random_walk_density(problem: Problem, long: BoolArray) -> FloatArray:
    """Spectral density q (6,) of the velocity [v, w], m^2/s^3 and rad^2/s^3, from samples between the `long`
    intervals."""
    dt = problem.sequence.dt
    usual = float(np.median(dt))
    twist = problem.increment[~long] / dt[~long, None]
    noise = np.einsum("nii->i", problem.increment_covariance[~long] / dt[~long, None, None] ** 2) / len(twist)
    stretch = np.cumsum(long)[~long]
    shortest = max(1, round(min(SHORTEST_LAG / usual, len(twist))))
    longest = max(shortest, round(min(float(dt.max()) / usual, len(twist) - MIN_PAIRS)))
    density = np.zeros(6)
    for lag in np.unique(np.geomspace(shortest, longest, LAGS).astype(int)).tolist():
        together = stretch[lag:] == stretch[:-lag]
        if together.sum() >= MIN_PAIRS:
            change = np.mean((twist[lag:] - twist[:-lag])[together] ** 2, axis=0)
            density = np.maximum(density, (change - 2.0 * noise) / (lag * usual))
    return density
