"""The cost of a problem at an estimate, as the problem's docstring defines it: numpy only, whatever solved it."""

import numpy as np

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray, se3

from .reprojection import ROWS, reprojection


def cost(problem: Problem, estimate: Estimate, taken: BoolArray) -> float:
    """Half the sum of squared whitened residuals over the observations `taken` (n,) of the sequence's.

    Under the problem's kernel, with the increments and the landmarks' prior; NaN where the estimate lacks a pose or a
    landmark of them. The prior of the first pose is left out: it is held, or nearly.
    """
    table = reprojection(problem.sequence, estimate)
    table = table[taken[table["observation"].to_numpy()]]
    if len(table) < taken.sum():
        return float("nan")
    squared = problem.measurement.loss(pixel_squares(problem, table[list(ROWS)].to_numpy()))
    return 0.5 * float(
        squared.sum() + motion_squares(problem, estimate).sum() + prior_squares(problem, estimate, taken)
    )


def pixel_squares(problem: Problem, residual: FloatArray) -> FloatArray:
    """(n,) whitened squares of residuals (n, 4) in px: of the three rows (uL, uR, (vL + vR) / 2)."""
    return np.asarray(np.sum(problem.measurement.whitened(residual) ** 2, axis=1))


def motion_squares(problem: Problem, estimate: Estimate) -> FloatArray:
    """(T-1,) whitened squares of what `motion_residuals` says."""
    residual = motion_residuals(problem, estimate)
    whitened = np.linalg.solve(problem.increment_covariance, residual[:, :, None])[:, :, 0]
    return np.asarray(np.einsum("ti,ti->t", residual, whitened))


def motion_residuals(problem: Problem, estimate: Estimate) -> FloatArray:
    """(T-1, 6) log(exp(increment)^-1 T_k^-1 T_(k+1)): by how much the estimated motion differs from the measured."""
    return se3.log(se3.inverse(se3.exp(problem.increment)) @ se3.relative(estimate.world_T_imu))


def prior_squares(problem: Problem, estimate: Estimate, taken: BoolArray) -> float:
    """Sum of the whitened squares of the priors of the landmarks that the observations `taken` (n,) see."""
    prior = problem.landmark_prior
    if prior is None:
        return 0.0
    index = np.unique(problem.sequence.observations.landmark[taken])
    position = estimate.landmarks.position[np.searchsorted(estimate.landmarks.index, index)]
    apart = position - prior.mean[problem.feature_row(index)]
    return float(np.einsum("mi,ij,mj->", apart, np.linalg.inv(prior.covariance), apart))
