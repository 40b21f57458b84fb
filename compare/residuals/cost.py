"""Cost of a problem at an estimate: half the sum of squared whitened residuals, in numpy only."""

import numpy as np

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, se3, strapdown
from fgbaseline.geometry.stereo_camera import PIXEL_COMPONENTS

from .inertial_cost import inertial_squares, start_square
from .reprojection import reprojection


def cost(problem: Problem, estimate: Estimate, taken: BoolArray) -> float:
    """Half the sum of squared whitened residuals: pixels, motion and landmark priors.

    `taken` (n,) is the mask of the sequence's observations that count; their pixels have the loss of the problem's
    kernel. NaN where the estimate lacks a pose or a landmark of `taken`. The first pose is fixed and has no prior term;
    with raw inertial data the prior of the start counts in the directions in which it has variance.
    """
    table = reprojection(problem.sequence, estimate)
    table = table[taken[table["observation"].to_numpy()]]
    if len(table) < taken.sum():
        return float("nan")
    squared = problem.measurement.loss(pixel_squares(problem, table[list(PIXEL_COMPONENTS)].to_numpy()))
    start = 0.0 if problem.start is None else start_square(problem, problem.start, estimate)
    return 0.5 * float(
        squared.sum() + motion_squares(problem, estimate).sum() + start + prior_squares(problem, estimate, taken)
    )


def pixel_squares(problem: Problem, residual: FloatArray) -> FloatArray:
    """Squared whitened norms (n,) of residuals (n, 4) in px, over the three rows (uL, uR, (vL + vR) / 2)."""
    return np.asarray(np.sum(problem.measurement.whitened(residual) ** 2, axis=1))


def motion_squares(problem: Problem, estimate: Estimate) -> FloatArray:
    """Squared whitened norms (T-1,) of `motion_residuals`, or of `inertial_residuals`."""
    if problem.imu is not None:
        return inertial_squares(problem.imu, estimate)
    residual = motion_residuals(problem, estimate)
    whitened = np.linalg.solve(problem.increment_covariance, residual[:, :, None])[:, :, 0]
    return np.asarray(np.einsum("ti,ti->t", residual, whitened))


def motion_degrees(problem: Problem) -> int:
    """Degrees of freedom of each of `motion_squares`: 6, or 15 with raw inertial data."""
    return 6 if problem.imu is None else strapdown.STATE


def motion_residuals(problem: Problem, estimate: Estimate) -> FloatArray:
    """Motion residuals log(exp(increment)^-1 T_k^-1 T_(k+1)) (T-1, 6), [v, w] in m and rad."""
    return se3.log(se3.inverse(se3.exp(problem.increment)) @ se3.relative(estimate.world_T_imu))


def prior_squares(problem: Problem, estimate: Estimate, taken: BoolArray) -> float:
    """Sum of squared whitened prior residuals of the landmarks that the mask `taken` (n,) of observations has."""
    prior = problem.landmark_prior
    if prior is None:
        return 0.0
    index = np.unique(problem.sequence.observations.landmark[taken])
    position = estimate.landmarks.position[np.searchsorted(estimate.landmarks.index, index)]
    apart = position - prior.mean[problem.feature_row(index)]
    return float(np.einsum("mi,ij,mj->", apart, np.linalg.inv(prior.covariance), apart))
