"""How many errors in a row to keep together, so that drawing blocks keeps their correlation in time."""

from typing import NamedTuple

import numpy as np

from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray

INSIGNIFICANT_IN_A_ROW = 5


class BlockLength(NamedTuple):
    """How many values in a row to keep together."""

    length: int
    correlation_ends: bool
    """within the lags that can be looked at; False where values trend or drift"""


def block_length(values: FloatArray) -> BlockLength:
    """The block length (1 to n/3) for a moving-block bootstrap of the mean of values (n,), from their autocorrelation.

    Politis and White (2004), as corrected by Patton, Politis and White (2009): the lag m after which five
    autocorrelations or more in a row are insignificant (|rho| < 2 sqrt(log10(n) / n)), a flat-top window of twice that
    width, and b = (3 G^2 / (2 g^2))^(1/3) n^(1/3), with g the spectral density at zero (the sum of the
    autocovariances) and G the same sum weighted by |lag|. Where no such lag comes within about sqrt(n), it is the
    longest that is allowed, 3 sqrt(n).
    """
    n = len(values)
    longest = max(1, int(np.ceil(min(3.0 * np.sqrt(n), n / 3.0))))
    if n < 2 * INSIGNIFICANT_IN_A_ROW or np.ptp(values) == 0.0:
        return BlockLength(1, True)
    in_a_row = max(INSIGNIFICANT_IN_A_ROW, int(np.ceil(np.sqrt(np.log10(n)))))
    widest = min(int(np.ceil(np.sqrt(n))) + in_a_row, n - 1)
    covariance = autocovariance(values)[: widest + 1]
    significant = np.abs(covariance[1:] / covariance[0]) >= 2.0 * np.sqrt(np.log10(n) / n)
    last = _last_before_quiet(significant, in_a_row)
    if last is None:
        return BlockLength(longest, False)
    window = min(2 * max(last, 1), widest)
    lag = np.arange(window + 1)
    weighted = np.clip(2.0 * (1.0 - lag / window), 0.0, 1.0) * covariance[: window + 1]
    density = weighted[0] + 2.0 * weighted[1:].sum()
    slope = 2.0 * float(lag @ weighted)
    if density <= 0.0:
        return BlockLength(1, True)
    length = (1.5 * (slope / density) ** 2 * n) ** (1.0 / 3.0)
    return BlockLength(int(np.clip(np.ceil(length), 1, longest)), True)


def autocovariance(values: FloatArray) -> FloatArray:
    """(n,) autocovariances of values (n,) at lags 0 to n - 1, each divided by n; by Fourier transform."""
    n = len(values)
    spectrum = np.fft.rfft(values - values.mean(), 2 * n)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, 2 * n)[:n] / n)


def _last_before_quiet(significant: BoolArray, in_a_row: int) -> int | None:
    """The lag after which `in_a_row` lags in a row are insignificant."""
    quiet_so_far = np.cumsum(np.concatenate([[0], ~significant]))
    quiet = quiet_so_far[in_a_row:] - quiet_so_far[:-in_a_row] == in_a_row
    return int(np.argmax(quiet)) if quiet.any() else None
