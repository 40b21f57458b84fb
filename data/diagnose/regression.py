"""Robust linear regression with a Gaussian prior on the coefficients."""

from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray

TUKEY = 4.685
"""sigmas, beyond which a residual has no weight (Tukey's biweight at 95 % efficiency)"""
ROUNDS = 8
FARTHEST = 3.0
"""prior deviations from zero at which a coefficient is held: a price alone, however high, is paid where there are many
samples, and an error of 90° or of the whole speed is none of calibration"""


class Regression(NamedTuple):
    """y = X theta + noise, each axis of y with noise of its own."""

    theta: FloatArray
    """(p,)"""
    covariance: FloatArray
    """(p, p)"""
    sigma: FloatArray
    """(d,) deviation of the bulk of the residuals"""
    log_likelihood: float
    """of the bulk, less the price of coefficients far from zero; for comparing models of the same data"""


def regress(y: FloatArray, X: FloatArray, prior: FloatArray) -> Regression:
    """Coefficients (p,) of X (n, d, p) for y (n, d), with prior deviations (p,), by reweighted least squares."""
    theta = np.zeros(X.shape[2])
    information = np.diag(1.0 / prior**2)
    for _ in range(ROUNDS):
        residual = y - X @ theta
        sigma = _bulk(residual)
        weight = np.clip(1.0 - (residual / (TUKEY * sigma)) ** 2, 0.0, None) ** 2 / sigma**2
        information = np.einsum("nip,ni,niq->pq", X, weight, X) + np.diag(1.0 / prior**2)
        theta = np.linalg.solve(information, np.einsum("nip,ni,ni->p", X, weight, y))
        theta = np.clip(theta, -FARTHEST * prior, FARTHEST * prior)
    sigma = _bulk(y - X @ theta)
    likelihood = -len(y) * float(np.log(sigma).sum()) - 0.5 * float(np.sum((theta / prior) ** 2))
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return Regression(theta, covariance, sigma, likelihood)


def _bulk(residual: FloatArray) -> FloatArray:
    """(d,) 1.4826 times the median size of residuals (n, d): the deviation of a Gaussian bulk."""
    return np.asarray(np.maximum(1.4826 * np.median(np.abs(residual), axis=0), 1e-9), dtype=np.float64)
