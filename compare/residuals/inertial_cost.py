"""Residuals of raw inertial samples between the frames, and of the start, of an estimate with velocity and biases."""

import numpy as np

from fgbaseline.data import Estimate, Problem
from fgbaseline.data.problem.inertial import LEAST_WALK, ImuIntervals, InertialStart
from fgbaseline.geometry import FloatArray, se3, strapdown

from ..statistics.chi_square import mahalanobis_squared

WALKS = (strapdown.GYROSCOPE_BIAS, strapdown.ACCELEROMETER_BIAS)


def inertial_residuals(imu: ImuIntervals, estimate: Estimate) -> tuple[FloatArray, FloatArray]:
    """Residuals (T-1, 15) of the samples between frames, and their covariances (T-1, 15, 15).

    A residual is the state of frame k + 1 relative to its prediction from frame k, with the biases of frame k, in the
    order and units of `geometry.strapdown` and with velocities in world axes. NaN where the estimate lacks a pose,
    velocity or bias.
    """
    n = len(estimate.world_T_imu) - 1
    residual = np.full((n, strapdown.STATE), np.nan)
    covariance = np.tile(np.eye(strapdown.STATE), (n, 1, 1))
    v, bg, ba = estimate.velocity, estimate.gyroscope_bias, estimate.accelerometer_bias
    if v is None or bg is None or ba is None:
        return residual, covariance
    T = estimate.world_T_imu
    known = np.isfinite(T).all(axis=(1, 2)) & np.isfinite(np.concatenate([v, bg, ba], axis=1)).all(axis=1)
    for k in np.flatnonzero(known[:-1] & known[1:]).tolist():
        motion = imu.motion(k, bg[k], ba[k])
        pose, velocity = strapdown.predict(T[k], v[k], motion, imu.gravity_vector)
        residual[k, :6] = se3.log(se3.inverse(pose) @ T[k + 1])
        residual[k, 6:] = np.concatenate([v[k + 1] - velocity, bg[k + 1] - bg[k], ba[k + 1] - ba[k]])
        covariance[k] = strapdown.world_axes(motion, T[k, :3, :3], pose[:3, :3])[1]
        for block, density in zip(WALKS, imu.densities[k, [0, 2]], strict=True):
            least = (LEAST_WALK * density) ** 2 * motion.dt
            index = range(block.start, block.stop)
            covariance[k, index, index] = np.maximum(covariance[k, index, index], least)
    return residual, covariance


def inertial_squares(imu: ImuIntervals, estimate: Estimate) -> FloatArray:
    """Squared whitened norms (T-1,) of `inertial_residuals`, 15 degrees of freedom each."""
    return mahalanobis_squared(*inertial_residuals(imu, estimate))


def start_square(problem: Problem, start: InertialStart, estimate: Estimate) -> float:
    """Squared whitened norm of the state of frame 0 minus the start, in the directions with variance."""
    v, bg, ba = estimate.velocity, estimate.gyroscope_bias, estimate.accelerometer_bias
    if v is None or bg is None or ba is None:
        return float("nan")
    off = [v[0] - start.velocity, np.concatenate([bg[0], ba[0]]) - start.bias]
    pose = se3.log(se3.inverse(problem.initial_pose) @ estimate.world_T_imu[0])
    free = start.free_directions
    error, P = free.T @ np.concatenate([pose, *off]), free.T @ start.covariance @ free
    return float(mahalanobis_squared(error[None], P[None])[0])
