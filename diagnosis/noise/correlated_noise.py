"""Time-correlated noise: inflation factors of white noise, for pixels or for velocities.

Pixel errors are correlated along a track, and some are common to all tracks, so that averaging over frames helps less
than for white noise, and a filter that assumes white noise is overconfident. Velocities may have correlated errors too.
Over windows of the recording the motions by tracks and by velocities differ by more than white noise explains. Where
the motions by two halves of the tracks differ as well, the excess is attributed to the pixels, else to velocities.
"""

from dataclasses import dataclass, replace

import numpy as np

from fgbaseline.data.problem import NoiseSettings
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import FloatArray, se3, so3

from ..robust_constants import CHI_SQUARE_MEDIAN
from ..window_adjustment.bundle_adjustment import fit_each_window
from ..window_adjustment.residuals import MISALIGNMENT, SCALE, Window, WindowData

LOOSE = 30.0
"""factor on the velocity noise, so that tracks dominate a fit"""
MIN_LANDMARKS = 8
"""smallest number of landmarks of a fit dominated by tracks"""
MIN_WINDOWS = 3
LASTING = 1.5
"""inflation `halves` above which pixel errors count as time-correlated"""
MAX_FACTOR = 20.0
ITERATIONS = 4


@dataclass(frozen=True, slots=True)
class Inflation:
    """Factors on white noise, at least 1."""

    halves: float = 1.0
    """inflation of the pixel noise for errors independent between tracks: from the motions by two halves"""
    pixel: float = 1.0
    """total inflation of the pixel noise; above `halves` where tracks share errors: the excess against velocities is
    attributed to cameras whose errors are time-correlated"""
    velocity: float = 1.0
    """inflation of the velocity noise, to which the excess is attributed otherwise"""


def inflation_of(
    sequence: Sequence, windows: list[Window], calibration: FloatArray, sigmas: NoiseSettings, processes: int = 1
) -> Inflation:
    """Inflation from windows without gaps, with their common `calibration` parameters (8,) and white noise `sigmas`."""
    loose = NoiseSettings(sigmas.pixel, LOOSE * sigmas.linear_velocity, LOOSE * sigmas.angular_velocity)
    pairs = [window for window in windows if len(window[2]) >= 2 * MIN_LANDMARKS]
    both = [_half(window, parity) for window in pairs for parity in (0, 1)]
    ends = _ends(sequence, both, loose, calibration, processes)
    halves = _factor([_between(one, other) for one, other in zip(ends[::2], ends[1::2], strict=True)])
    by_cameras, by_velocities = [], []
    enough = [window for window in windows if len(window[2]) >= MIN_LANDMARKS]
    whole = _ends(sequence, enough, loose, calibration, processes)
    for (data, _, _), (seen, C) in zip(enough, whole, strict=True):
        driven, C_driven = _driven(data, calibration, sigmas)
        gap = se3.log(se3.inverse(seen) @ driven)
        by_cameras.append((gap, C, C_driven))
        by_velocities.append((gap, C_driven, halves**2 * C))
    if halves > LASTING:
        return Inflation(halves, max(halves, _factor(by_cameras)))
    return Inflation(halves, halves, _factor(by_velocities))


End = tuple[FloatArray, FloatArray]
"""pose (4, 4) and covariance (6, 6) of the last frame of a window"""


def _between(one: End, other: End) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Difference (6,) of the last pose between two halves of the tracks, and its covariance for white noise."""
    return se3.log(se3.inverse(one[0]) @ other[0]), one[1] + other[1], np.zeros((6, 6))


def _half(window: Window, parity: int) -> Window:
    """Half of the window's landmarks, even or odd."""
    data, poses, points = window
    chosen = data.landmark % 2 == parity
    half = replace(data, frame=data.frame[chosen], landmark=data.landmark[chosen] // 2, pixel=data.pixel[chosen])
    return half, poses, points[parity::2]


def _ends(
    sequence: Sequence, windows: list[Window], loose: NoiseSettings, calibration: FloatArray, processes: int
) -> list[End]:
    """Last pose of each window from the tracks."""
    common = [calibration] * len(windows)
    fits = fit_each_window(sequence.stereo_camera, sequence.imu_T_cam, windows, loose, common, ITERATIONS, processes)
    return [(fit.poses[-1], fit.last_covariance) for fit in fits]


def _driven(data: WindowData, calibration: FloatArray, sigmas: NoiseSettings) -> tuple[FloatArray, FloatArray]:
    """Last pose of each window from the velocities, corrected for bias, scale and misalignment."""
    back = so3.exp_so3(calibration[MISALIGNMENT])
    velocity, rate = data.twist[:, :3] / (1.0 + calibration[SCALE]), data.twist[:, 3:] - calibration[:3]
    path = se3.compose(se3.exp(np.concatenate([velocity @ back, rate @ back], axis=1) * data.dt[:, None]))
    sigma = np.hypot(np.repeat([sigmas.linear_velocity, sigmas.angular_velocity], 3), data.deviation)
    J = se3.adjoint(se3.inverse(path[-1]) @ path[1:]) * sigma[:, None] * data.dt[:, None, None]
    return path[-1], np.einsum("kij,klj->il", J, J)


def _factor(differences: list[tuple[FloatArray, FloatArray, FloatArray]]) -> float:
    """Factor f at which the median of d^T (f^2 C + A)^-1 d over (d, C, A) is that of chi-square; 1 where it is less."""
    if len(differences) < MIN_WINDOWS:
        return 1.0
    d, C, A = (np.array(part) for part in zip(*differences, strict=True))

    def median(factor: float) -> float:
        solved = np.linalg.solve(factor**2 * C + A, d[:, :, None])[:, :, 0]
        return float(np.median(np.einsum("ni,ni->n", d, solved)))

    low, high = 1.0, MAX_FACTOR
    if median(low) <= CHI_SQUARE_MEDIAN[6]:
        return low
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if median(middle) > CHI_SQUARE_MEDIAN[6] else (low, middle)
    return high
