"""Variance components and calibration errors from bundle adjustments of many short windows."""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data.problem import NoiseSettings
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray

from ..odometry.stereo_odometry import Odometry
from ..robust_constants import CHI_SQUARE_MEDIAN, MAD_TO_SIGMA
from ..window_adjustment.bundle_adjustment import CALIBRATION_PRIOR, WindowFit, fit_each_window
from ..window_adjustment.residuals import N_CALIBRATION
from ..window_adjustment.selection import spread_spans, unbroken_spans, windows_of
from .correlated_noise import Inflation, inflation_of

ROUNDS = 6
START = NoiseSettings(pixel=1.0, linear_velocity=0.4, angular_velocity=0.02)
"""px, baselines/s and rad/s: initial values of the noise"""
FLOOR = NoiseSettings(pixel=0.02, linear_velocity=2e-4, angular_velocity=1e-5)
"""px, baselines/s and rad/s: lower bounds of the noise"""
EFFICIENCY = 0.37
"""efficiency of a variance from a median, relative to one from all residuals"""
SIGNIFICANT = 4.0
"""standard errors, from which on an estimate is significant"""
MIN_REDUNDANCY = 0.05
"""redundancy of a velocity residual below which the fit follows the velocity, and the residual is not used"""


@dataclass(frozen=True, eq=False, slots=True)
class CalibrationFit:
    """Noise and calibration parameters common to all windows."""

    sigmas: NoiseSettings
    """noise for a filter, correlated errors included"""
    calibration: FloatArray
    """(8,) calibration parameters: see `residuals.N_CALIBRATION`"""
    deviation: FloatArray
    """(8,) standard errors, from the spread between windows where that is larger than the formal ones

    They are widened for the few residuals from which short recordings estimate the noise (Student's t): SIGNIFICANT of
    them are as improbable as in a long recording.
    """
    windows: int
    inflation: Inflation
    white: NoiseSettings
    """white noise within a window: `sigmas` without time-correlated errors"""
    motion: FloatArray
    """(n, 6) velocity residuals of all windows, normalized by sigma and redundancy: standard normal under the estimated
    noise; NaN where tracks do not determine the velocity"""


def fit_windows(
    sequence: Sequence,
    odometry: Odometry,
    twist: FloatArray,
    processes: int = 1,
    deviation: FloatArray | None = None,
) -> CalibrationFit | None:
    """The fit of windows spread over the recording; None where no window has enough observations.

    `twist` (T-1, 6) is the recorded velocity of each interval in the axes of imu_T_cam, `deviation` (T-1, 6) that of
    interpolated ones. The sigmas are the variance components at which squared residuals match their degrees of freedom,
    as medians over axes and windows.
    """
    windows = windows_of(sequence, odometry, twist, spread_spans(sequence.n_frames), deviation)
    if not windows:
        return None
    baseline = sequence.stereo_camera.baseline
    sigmas = replace(START, linear_velocity=START.linear_velocity * baseline)
    estimates = [np.zeros(N_CALIBRATION)] * len(windows)
    fits: list[WindowFit] = []
    for _ in range(ROUNDS):
        fits = fit_each_window(sequence.stereo_camera, sequence.imu_T_cam, windows, sigmas, estimates, 1, processes)
        windows = [(data, fit.poses, fit.points) for (data, _, _), fit in zip(windows, fits, strict=True)]
        estimates = [fit.calibration for fit in fits]
        sigmas = _components(fits, sigmas, baseline)
    mean, error = _agreed(fits)
    unbroken = windows_of(sequence, odometry, twist, unbroken_spans(odometry), deviation)
    inflation = inflation_of(sequence, unbroken, mean, sigmas, processes)
    noise = NoiseSettings(
        sigmas.pixel * inflation.pixel,
        sigmas.linear_velocity * inflation.velocity,
        sigmas.angular_velocity * inflation.velocity,
    )
    residual, redundancy = _redundant_residuals(fits)
    if sigmas.angular_velocity > FLOOR.angular_velocity:
        error = error * _widening(np.where(np.isnan(residual), 0.0, redundancy))
    motion = residual / np.repeat([sigmas.linear_velocity, sigmas.angular_velocity], 3) / np.sqrt(redundancy)
    return CalibrationFit(noise, mean, error, len(fits), inflation, sigmas, motion)


def _widening(redundancy: FloatArray) -> float:
    """Factor of standard errors by the redundancies (n, 6) of the velocities from which the noise is estimated."""
    from scipy.special import ndtr, stdtrit  # a refused file does not wait for scipy

    freedom = EFFICIENCY * min(float(redundancy[:, :3].sum()), float(redundancy[:, 3:].sum()))
    return float(-stdtrit(max(freedom, 1.0), float(ndtr(-SIGNIFICANT))) / SIGNIFICANT)


def half_cost(
    sequence: Sequence,
    odometry: Odometry,
    twist: FloatArray,
    sigmas: NoiseSettings,
    processes: int = 1,
    deviation: FloatArray | None = None,
) -> float:
    """Half the sum of squares, in `sigmas`, that remains when windows are fitted to these velocities (T-1, 6)."""
    whiten = np.repeat([sigmas.linear_velocity, sigmas.angular_velocity], 3)
    total = 0.0
    windows = windows_of(sequence, odometry, twist, spread_spans(sequence.n_frames), deviation)
    start = [np.zeros(N_CALIBRATION)] * len(windows)
    for fit in fit_each_window(sequence.stereo_camera, sequence.imu_T_cam, windows, sigmas, start, 5, processes):
        total += 0.5 * float(fit.pixel_squared.sum() + np.sum((fit.motion_residual / whiten) ** 2))
    return total


def _components(fits: list[WindowFit], sigmas: NoiseSettings, baseline: float) -> NoiseSettings:
    residual, redundancy = _redundant_residuals(fits)
    is_known = (~np.isnan(residual)).any(axis=0).all()
    variance = np.nanmedian(residual**2 / redundancy, axis=0) / CHI_SQUARE_MEDIAN[1] if is_known else np.zeros(6)
    pixel = np.median([fit.pixel_squared.sum() / max(fit.degrees_of_freedom, 1.0) for fit in fits])
    return NoiseSettings(
        pixel=max(FLOOR.pixel, sigmas.pixel * float(np.sqrt(pixel))),
        linear_velocity=max(FLOOR.linear_velocity * baseline, float(np.sqrt(variance[:3].mean()))),
        angular_velocity=max(FLOOR.angular_velocity, float(np.sqrt(variance[3:].mean()))),
    )


def _redundant_residuals(fits: list[WindowFit]) -> tuple[FloatArray, FloatArray]:
    """Velocity residuals (n, 6), NaN where their redundancy is too small, and that redundancy, at least the minimum."""
    residual = np.concatenate([fit.motion_residual for fit in fits])
    redundancy = np.concatenate([fit.motion_redundancy for fit in fits])
    return np.where(redundancy > MIN_REDUNDANCY, residual, np.nan), np.maximum(redundancy, MIN_REDUNDANCY)


def _agreed(fits: list[WindowFit]) -> tuple[FloatArray, FloatArray]:
    """Information-weighted mean (8,) of the calibration parameters, without outliers, and standard errors (8,)."""
    information = np.array([fit.calibration_information for fit in fits])
    values = np.array([fit.calibration for fit in fits])
    center = np.median(values, axis=0)
    spread = MAD_TO_SIGMA * np.median(np.abs(values - center), axis=0) + 1e-9
    keep = (np.abs(values - center) < 5.0 * spread).all(axis=1) if len(fits) > 4 else np.ones(len(fits), dtype=bool)
    total = information[keep].sum(axis=0) + CALIBRATION_PRIOR
    mean = np.linalg.solve(total, np.einsum("wij,wj->i", information[keep], values[keep]))
    formal = np.sqrt(np.diag(np.linalg.inv(total)))
    # Variance of the mean from the spread of the windows (sandwich): (sum I)^-1 sum I d d^T I (sum I)^-1
    difference = np.einsum("wij,wj->wi", information[keep], values[keep] - mean)
    inverse = np.linalg.inv(total)
    spread_based = np.sqrt(np.diag(inverse @ (difference.T @ difference) @ inverse))
    return mean, np.asarray(np.maximum(formal, spread_based), dtype=np.float64)
