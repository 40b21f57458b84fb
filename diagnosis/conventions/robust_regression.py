"""Robust linear regression with a Gaussian prior on the coefficients."""

from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray

from ..robust_constants import MAD_TO_SIGMA

TUKEY = 4.685
"""sigmas, beyond which a residual has no weight (Tukey's biweight at 95 % efficiency)"""
ROUNDS = 8
FARTHEST = 3.0
"""Prior deviations from zero at which a coefficient is bounded. With many samples a penalty alone would allow more, but
an error of 90° or of the whole speed is no calibration error."""


class Regression(NamedTuple):
    """Linear model y = X theta + noise, with separate noise for each axis of y."""

    theta: FloatArray
    """(p,)"""
    covariance: FloatArray
    """(p, p)"""
    sigma: FloatArray
    """(d,) deviation of the bulk of the residuals"""
    log_likelihood: float
    """log-likelihood of the bulk minus the prior penalty, for the comparison of models"""


def regress(y: FloatArray, X: FloatArray, prior: FloatArray) -> Regression:
    """Coefficients (p,) of X (n, d, p) for y (n, d), with prior deviations (p,), by reweighted least squares."""
    n, d, p = X.shape
    columns, price = np.ascontiguousarray(X.transpose(2, 1, 0)).reshape(p, d * n), np.diag(1.0 / prior**2)
    target = np.ascontiguousarray(y.T)
    theta: FloatArray = np.zeros(p)
    information = price
    for _ in range(ROUNDS):
        residual = target - (theta @ columns).reshape(d, n)
        sigma = _bulk(residual)[:, None]
        weight = np.maximum(1.0 - (residual / (TUKEY * sigma)) ** 2, 0.0) ** 2 / sigma**2
        weighted = columns * weight.reshape(-1)
        information = weighted @ columns.T + price
        theta = np.asarray(np.linalg.solve(information, weighted @ target.reshape(-1)), dtype=np.float64)
        theta = np.clip(theta, -FARTHEST * prior, FARTHEST * prior)
    deviation = _bulk(target - (theta @ columns).reshape(d, n))
    likelihood = -n * float(np.log(deviation).sum()) - 0.5 * float(np.sum((theta / prior) ** 2))
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return Regression(theta, covariance, deviation, likelihood)


def _bulk(residual: FloatArray) -> FloatArray:
    """Sigmas (d,) of the bulk of residuals (d, n): MAD_TO_SIGMA times their median absolute value."""
    half = residual.shape[1] // 2
    # np.median's value; it takes several times as long, and this is half of what a regression does.
    sorted_about = np.partition(np.abs(residual), half, axis=1)
    median = sorted_about[:, half]
    if residual.shape[1] % 2 == 0:
        median = 0.5 * (median + sorted_about[:, :half].max(axis=1))
    return np.asarray(np.maximum(MAD_TO_SIGMA * median, 1e-9), dtype=np.float64)
