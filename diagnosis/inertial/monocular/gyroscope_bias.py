"""Bias of the gyroscope at which the rays of one camera satisfy the epipolar constraint.

For the rotation R between two views, the normals f x R f' of all epipolar planes are perpendicular to the direction of
motion: their scatter has a smallest eigenvalue of zero (Kneip, Siegwart and Pollefeys, ECCV 2012). This holds at any
parallax, none included, and needs neither depth nor scale. The bias is the only unknown of the rotations.
"""

import numpy as np

from fgbaseline.geometry import FloatArray

from ...inertial_initialization.least_squares import GYROSCOPE_BIAS_SIGMA
from ...inertial_initialization.states import Motions
from ...robust_constants import MAD_TO_SIGMA
from .window_tracks import Rays

MIN_COMMON = 8
"""tracks of a pair of keyframes"""
STEPS = (1, 2, 4)
"""keyframes between the views of a pair"""
ITERATIONS = 10
CONVERGED = 1e-6
"""rad/s"""
SLOPE = 1e-6
"""rad/s, of the finite differences"""
HUBER = 2.0
"""robust deviations beyond which a ray's weight falls"""
SMALLEST_SIGMA = 1e-5
"""rad, of a ray"""

Pair = tuple[int, int, FloatArray, FloatArray]
"""two keyframes with the directions (k, 3) of their common points"""


def epipolar_bias(rays: Rays, integrated: Motions) -> FloatArray:
    """Gyroscope bias (3,), rad/s, from motions `integrated` with zero bias. Raises ValueError without pairs."""
    pairs = _pairs(rays, len(integrated.dt) + 1)
    if not pairs:
        raise ValueError(f"no two keyframes share {MIN_COMMON} tracks")
    bias = np.zeros(3)
    for _ in range(ITERATIONS):
        axes = [_direction(pair, _rotations(integrated, bias)) for pair in pairs]
        residual = _residuals(pairs, axes, integrated, bias)
        slopes = [(_residuals(pairs, axes, integrated, bias + SLOPE * e) - residual) / SLOPE for e in np.eye(3)]
        J = np.stack(slopes, axis=1)
        sigma = max(SMALLEST_SIGMA, MAD_TO_SIGMA * float(np.median(np.abs(residual))))
        weight = np.minimum(1.0, HUBER * sigma / np.maximum(np.abs(residual), 1e-12)) / sigma**2
        H = (J.T * weight) @ J + np.eye(3) * GYROSCOPE_BIAS_SIGMA**-2
        step = np.linalg.solve(H, -(J.T * weight) @ residual - bias * GYROSCOPE_BIAS_SIGMA**-2)
        bias = bias + step
        if np.abs(step).max() < CONVERGED:
            break
    return np.asarray(bias, dtype=np.float64)


def _pairs(rays: Rays, n: int) -> list[Pair]:
    pairs = [(i, i + step, *rays.common(i, i + step)) for step in STEPS for i in range(n - step)]
    return [pair for pair in pairs if len(pair[2]) >= MIN_COMMON]


def _rotations(integrated: Motions, bias: FloatArray) -> FloatArray:
    """Rotations (n, 3, 3) of the keyframes in the axes of the first."""
    biases = np.tile(np.concatenate([bias, np.zeros(3)]), (len(integrated.dt), 1))
    R = [np.eye(3)]
    for turn in integrated.at(biases).rotation:
        R.append(R[-1] @ turn)
    return np.array(R)


def _normals(pair: Pair, R: FloatArray) -> FloatArray:
    i, j, first, second = pair
    return np.cross(first, second @ (R[i].T @ R[j]).T)


def _direction(pair: Pair, R: FloatArray) -> FloatArray:
    """Direction of motion (3,) of a pair, robust against wrong tracks by two rounds of weights."""
    normals = _normals(pair, R)
    weight = np.ones(len(normals))
    axis = np.zeros(3)
    for _ in range(2):
        axis = np.linalg.eigh((normals.T * weight) @ normals)[1][:, 0]
        apart = np.abs(normals @ axis)
        weight = np.minimum(1.0, max(SMALLEST_SIGMA, HUBER * float(np.median(apart))) / np.maximum(apart, 1e-12))
    return np.asarray(axis, dtype=np.float64)


def _residuals(pairs: list[Pair], axes: list[FloatArray], integrated: Motions, bias: FloatArray) -> FloatArray:
    R = _rotations(integrated, bias)
    return np.concatenate([_normals(pair, R) @ axis for pair, axis in zip(pairs, axes, strict=True)])
