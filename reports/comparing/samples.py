"""How much data the figures of an estimate rest on: what a gate needs to know before it says that a limit holds."""

import numpy as np

from fgbaseline import compare
from fgbaseline.geometry import FloatArray

from .comparison import Comparison, Result

OF_POSES = ("translation", "rotation_deg", "pose", "drift", "shares", "final_m", "passing", "alignment")
"""figures of all paired poses"""


def coverage(comparison: Comparison, result: Result) -> float:
    """The share of the reference's time in which there are paired poses: see `compare.time_coverage`."""
    return compare.time_coverage(result.matched.reference.t, comparison.reference.trajectory.t)


def samples(comparison: Comparison, result: Result) -> dict[str, dict[str, float]]:
    """By the beginning of a metric's path: `n` of what it is taken over, and the `coverage` of the estimate's time.

    n are pairs of poses, of the reprojection observations, of the map landmarks; what is not spread over time has no
    coverage. Errors of motions have the number of `stretches` that they are of, too.
    """
    matched, whole = result.matched, result.entry.trajectory.t
    t = matched.estimate.t - matched.offset

    def of(stamps: FloatArray) -> dict[str, float]:
        return {"n": len(stamps), "coverage": compare.time_coverage(stamps, whole)}

    found: dict[str, dict[str, float]] = dict.fromkeys(OF_POSES, of(t))
    stretches = {f"relative.{delta}": table for delta, table in result.relative.items()}
    if result.segments is not None:
        stretches["segments"] = result.segments.table
    for key, table in stretches.items():
        start, end = (t[table[column].to_numpy()] for column in ("start", "end"))
        found[key] = {"n": len(t), "coverage": compare.interval_coverage(start, end, whole), "stretches": len(table)}
    if result.claimed is not None:
        found["nees"] = of(t[np.isfinite(result.claimed.nees)])
    if result.name in comparison.ranking.at:
        found |= dict.fromkeys(("common", "behind"), of(t[comparison.ranking.at[result.name]]))
    return {**found, **_without_time(comparison, result)}


def _without_time(comparison: Comparison, result: Result) -> dict[str, dict[str, float]]:
    pixels, ranking = result.pixels, comparison.held_out
    tables = {} if pixels is None else {"": pixels.own, "_common": pixels.common, "_along": pixels.along}
    counts = {f"reprojection{kind}": len(table) for kind, table in tables.items() if table is not None}
    if result.map is not None:
        counts["map"] = len(result.map)
    if ranking is not None and result.name in ranking.index:
        counts["held_out"] = int(ranking.attrs["n"])
    return {key: {"n": n} for key, n in counts.items()}
