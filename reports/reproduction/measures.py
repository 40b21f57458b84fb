"""Figures that several claims ask for, and how they stand in sentences."""

from math import isfinite

import numpy as np

from fgbaseline.geometry import FloatArray


def metres(value: float) -> str:
    """'0.35 m', '79.6 m', '1342 m', '28.9 km'; 'no path' for what is not a number."""
    if not isfinite(value):
        return "no path"
    size = abs(value)
    if size >= 9_999.5:
        return f"{value / 1000:.3g} km"
    return f"{value:.0f} m" if size >= 999.5 else f"{value:.3g} m"


def per_cent(share: float) -> str:
    """'16.7 %'."""
    return f"{100.0 * share:.3g} %" if isfinite(share) else "–"


def px(value: float) -> str:
    """'30.6 px', or 'no path'."""
    return f"{value:.3g} px" if isfinite(value) else "no path"


def path_length(path: FloatArray) -> float:
    """m: the length of a path (T, 4, 4)."""
    return float(np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1).sum())
