"""The moments that several estimates have in common: estimates are ranked over these."""

from collections.abc import Mapping

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray

from .association import nearest_pairs

LEAST_SHARE = 0.1
"""of the moments of the estimate that has most: an estimate with fewer takes no part, or it would leave nothing of the
others"""


def taking_part(counts: Mapping[str, int]) -> list[str]:
    """The names that have enough moments to be ranked together, of so many each."""
    most = max(counts.values(), default=0)
    return [name for name, n in counts.items() if n and n >= LEAST_SHARE * most]


def common_moments(stamps: Mapping[str, FloatArray], tolerance: float) -> dict[str, IntArray]:
    """By name the indices (m,) into its rising stamps (n,) of the moments that all of them have.

    The same stamps; where fewer than two are the same, stamps within `tolerance` (s) of those of the shortest.
    """
    if not stamps:
        return {}
    exact = _common(stamps, 0.0)
    return exact if len(next(iter(exact.values()))) > 1 else _common(stamps, tolerance)


def _common(stamps: Mapping[str, FloatArray], tolerance: float) -> dict[str, IntArray]:
    base = min(stamps.values(), key=len)
    pairs = {name: nearest_pairs(base, t, tolerance) for name, t in stamps.items()}
    kept = np.arange(len(base))
    for i, _ in pairs.values():
        kept = np.intersect1d(kept, i, assume_unique=True)
    return {name: np.asarray(j[np.searchsorted(i, kept)], dtype=np.int64) for name, (i, j) in pairs.items()}
