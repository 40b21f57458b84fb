"""Which estimate is nearest to the reference, and whether that is settled."""

from collections.abc import Mapping

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import RmseDifference

from .comparison import Comparison, Result


def ranked(comparison: Comparison) -> list[Result]:
    """Nearest to the reference first, by the RMSE of their positions."""
    return sorted(comparison.results.values(), key=rmse)


def rmse(result: Result) -> float:
    """Of the positions, m."""
    return float(result.statistics["translation"]["value"]["rmse"])


def behind_nearest(results: Mapping[str, Result], seed: int) -> dict[str, RmseDifference]:
    """By name, for all rivals but the nearest: the RMSE of its positions less that of the nearest, drawn in pairs.

    Over the moments of the reference at which both have a pose.
    """
    rivals = sorted((r for r in results.values() if not r.entry.by_product), key=rmse)
    if not rivals:
        return {}
    nearest, *others = rivals
    found = {}
    for other in others:
        _, here, there = np.intersect1d(
            other.matched.reference.t, nearest.matched.reference.t, assume_unique=True, return_indices=True
        )
        errors = (r.absolute["translation"].to_numpy()[k] for r, k in ((other, here), (nearest, there)))
        found[other.name] = compare.rmse_difference(*errors, seed=seed)
    return found
