"""Sample sizes and coverage of the metrics of an estimate, by which `check` decides if they can be judged."""

import numpy as np

from fgbaseline import compare
from fgbaseline.compare.trajectory_comparison.comparison import Comparison, Result
from fgbaseline.geometry import FloatArray

OF_POSES = ("translation", "rotation_deg", "pose", "drift", "shares", "final_m", "passing", "alignment")
"""values over all paired poses"""


def coverage(comparison: Comparison, result: Result) -> float:
    """Share of the reference's time in which there are paired poses: see `compare.time_coverage`."""
    return compare.time_coverage(result.matched.reference.t, comparison.reference.trajectory.t)


def samples(comparison: Comparison, result: Result) -> dict[str, dict[str, float]]:
    """Sample size `n` and `coverage` of the estimate's time, by key, a prefix of the key path of a metric.

    n counts pairs of poses, observations (reprojection) or landmarks (map). Values that are not spread over
    time have no coverage. Errors of relative motions also have the number of their `stretches`.
    """
    matched, whole = result.matched, result.entry.trajectory.t
    t = matched.estimate.t - matched.offset

    def of(stamps: FloatArray) -> dict[str, float]:
        return {"n": len(stamps), "coverage": compare.time_coverage(stamps, whole)}

    found: dict[str, dict[str, float]] = dict.fromkeys(OF_POSES, of(t))
    stretches = {f"relative.{delta}": table for delta, table in result.relative.items()}
    if result.segments is not None:
        stretches["segments"] = result.segments.columns
    for key, table in stretches.items():
        start, end = (t[table[column]] for column in ("start", "end"))
        found[key] = {"n": len(t), "coverage": compare.interval_coverage(start, end, whole), "stretches": len(start)}
    if result.reported_covariance is not None:
        found["nees"] = of(t[np.isfinite(result.reported_covariance.nees)])
    if result.name in comparison.ranking.at:
        found |= dict.fromkeys(("common", "behind"), of(t[comparison.ranking.at[result.name]]))
    return {**found, **_without_time(comparison, result)}


def _without_time(comparison: Comparison, result: Result) -> dict[str, dict[str, float]]:
    ranking = comparison.held_out
    tables = {} if result.pixels is None else result.pixels.tables
    counts = {key: len(table) for key, table in tables.items() if table is not None}
    if result.map is not None:
        counts["map"] = len(result.map)
    if ranking is not None and result.name in ranking.index:
        counts["held_out"] = int(ranking.attrs["n"])
    return {key: {"n": n} for key, n in counts.items()}
