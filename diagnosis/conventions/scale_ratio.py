"""Scale ratio of odometry to recorded velocities, in any axes and units.

Axes and delay are still unknown: the ratio is that of the convention and the lag of highest correlation.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.axis_conventions import AXIS_CONVENTIONS, axes_matrix
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray

from .axes import LAGS

MIN_CORRELATION = 0.6
"""correlation from which on the ratio of two signals is known within a factor of 1 / MIN_CORRELATION"""
CHANCE = 4.5
"""standard deviations of the correlation of noise"""
SURE = 3.0
"""standard errors"""
WINDOWS = (1, 4, 8, 16, 32)
"""lengths, in intervals, of moving averages, which reduce the noise and keep the motion"""
OUTER = 0.95
"""quantile of the sizes at which samples are clipped"""
MIN_SAMPLES = 8
MATRICES = np.stack([axes_matrix(name) for name in AXIS_CONVENTIONS])


class ScaleRatio(NamedTuple):
    """RMS of the odometry over RMS of the recorded velocity."""

    ratio: float
    """RMS ratio; NaN without a sample"""
    known: bool
    """whether the two velocities correlate; otherwise the ratio is one of noises"""
    correlation: float = 0.0
    samples: int = 0
    """number of samples that are compared"""

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the factor of the motion: the slopes of the two regressions of one velocity on the other.

        The noise of its regressor attenuates each of them (Frisch 1934); SURE standard errors are added.
        """
        if not self.known:
            return 0.0, np.inf
        c = self.correlation
        error = SURE * float(np.sqrt(max(0.0, 1.0 - c**2) / self.samples)) / c
        return self.ratio * c / (1.0 + error), self.ratio / c * (1.0 + error)

    def admits(self, factor: float, tolerance: float) -> bool:
        """Whether the factor is within the bounds, widened by a share `tolerance`."""
        low, high = self.bounds
        return bool(low / (1.0 + tolerance) <= factor <= high * (1.0 + tolerance))


def scale_ratio(seen: FloatArray, recorded: FloatArray, known: BoolArray, *, centered: bool) -> ScaleRatio:
    """The ratio of velocities: `seen` (T-1, 3) by odometry, where `known` (T-1,), over `recorded` (T-1, 3).

    `centered` subtracts the median of each first, since it may be a bias.
    """
    best = ScaleRatio(np.nan, known=False)
    most = 0.0
    for window in WINDOWS:
        for lag in LAGS:
            y, x = _samples(seen, np.roll(recorded, -lag, axis=0), known & _inside(len(known), lag), window)
            if len(y) < MIN_SAMPLES:
                continue
            y, x = (_clipped(signal - np.median(signal, axis=0) if centered else signal) for signal in (y, x))
            size_y, size_x = (float(np.sqrt(np.mean(signal**2))) for signal in (y, x))
            if size_y == 0.0 or size_x == 0.0:
                continue
            cross = np.einsum("ni,nj->ij", y / size_y, x / size_x) / (3 * len(y))
            correlation = float(np.einsum("cij,ij->c", MATRICES, cross).max())
            sure = bool(correlation > max(MIN_CORRELATION, CHANCE / np.sqrt(3 * len(y))))
            if np.isnan(best.ratio) or (sure and correlation > most):
                best = ScaleRatio(size_y / size_x, sure, correlation, len(y))
                most = correlation if sure else 0.0
    return best


def _inside(n: int, lag: int) -> BoolArray:
    """Mask (n,) of the samples for which sample k + lag exists."""
    k = np.arange(n) + lag
    return np.asarray((k >= 0) & (k < n), dtype=np.bool_)


def _samples(seen: FloatArray, recorded: FloatArray, known: BoolArray, window: int) -> tuple[FloatArray, FloatArray]:
    """Means (m, 3) of both over windows of so many intervals, all of which are known."""
    m = len(known) // window
    whole = known[: m * window].reshape(m, window).all(axis=1)
    y, x = (signal[: m * window].reshape(m, window, 3)[whole].mean(axis=1) for signal in (seen, recorded))
    return y, x


def _clipped(signal: FloatArray) -> FloatArray:
    """Samples (m, 3) with norms clipped at their quantile OUTER."""
    size = np.linalg.norm(signal, axis=1)
    most = np.quantile(size, OUTER)
    shorter = np.divide(most, size, out=np.ones_like(size), where=size > most)
    return np.asarray(signal * shorter[:, None], dtype=np.float64)
