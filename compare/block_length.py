"""How many errors in a row to keep together, so that drawing blocks keeps their correlation in time."""

import numpy as np

from fgbaseline.geometry import FloatArray

INSIGNIFICANT_IN_A_ROW = 5


def block_length(values: FloatArray) -> int:
    """The block length (1 to n/3) for a moving-block bootstrap of the mean of values (n,), from their autocorrelation.

    Politis and White (2004), as corrected by Patton, Politis and White (2009): the lag m after which five
    autocorrelations or more in a row are insignificant (|rho| < 2 sqrt(log10(n) / n)), a flat-top window of twice that
    width, and b = (3 G^2 / (2 g^2))^(1/3) n^(1/3), with g the spectral density at zero (the sum of the
    autocovariances) and G the same sum weighted by |lag|.
    """
    n = len(values)
    longest = max(1, int(np.ceil(min(3.0 * np.sqrt(n), n / 3.0))))
    if n < 2 * INSIGNIFICANT_IN_A_ROW or np.ptp(values) == 0.0:
        return 1
    in_a_row = max(INSIGNIFICANT_IN_A_ROW, int(np.ceil(np.sqrt(np.log10(n)))))
    widest = min(int(np.ceil(np.sqrt(n))) + in_a_row, n - 1)
    covariance = autocovariance(values)[: widest + 1]
    significant = np.abs(covariance[1:] / covariance[0]) >= 2.0 * np.sqrt(np.log10(n) / n)
    window = min(2 * max(_last_before_quiet(significant, in_a_row), 1), widest)
    lag = np.arange(window + 1)
    weighted = np.clip(2.0 * (1.0 - lag / window), 0.0, 1.0) * covariance[: window + 1]
    density = weighted[0] + 2.0 * weighted[1:].sum()
    slope = 2.0 * float(lag @ weighted)
    if density <= 0.0:
        return 1
    length = (1.5 * (slope / density) ** 2 * n) ** (1.0 / 3.0)
    return int(np.clip(np.ceil(length), 1, longest))


def autocovariance(values: FloatArray) -> FloatArray:
    """(n,) autocovariances of values (n,) at lags 0 to n - 1, each divided by n; by Fourier transform."""
    n = len(values)
    spectrum = np.fft.rfft(values - values.mean(), 2 * n)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, 2 * n)[:n] / n)


def _last_before_quiet(significant: np.ndarray, in_a_row: int) -> int:
    """The lag after which `in_a_row` lags in a row are insignificant; the last significant one where there is none."""
    quiet_so_far = np.cumsum(np.concatenate([[0], ~significant]))
    quiet = quiet_so_far[in_a_row:] - quiet_so_far[:-in_a_row] == in_a_row
    if quiet.any():
        return int(np.argmax(quiet))
    return int(np.flatnonzero(significant)[-1]) + 1
