"""How much data the figures of a run's estimator rest on, which decides whether a limit can be judged."""

from collections.abc import Mapping

import numpy as np

from fgbaseline import compare
from fgbaseline.data.observations import BoolArray

from .common_frames import known
from .comparison import Result, Run


def samples(run: Run, result: Result) -> dict[str, dict[str, float]]:
    """By the beginning of a metric's path: `n` of what it is taken over, and the `coverage` of the recording's time.

    n are frames, of the reprojection observations, of the map landmarks, else tracks; what is not spread over time has
    no coverage.
    """
    t, evidence = run.problem.sequence.t, result.evidence
    found: dict[str, dict[str, float]] = {}

    def of_frames(frames: BoolArray, *keys: str) -> None:
        sample = {"n": int(frames.sum()), "coverage": compare.time_coverage(t[frames], t)}
        found.update(dict.fromkeys(keys, sample))

    if result.divergence is not None:
        of_frames(known(result.divergence), "divergence")
    if result.truth is not None:
        of_frames(known(result.truth), "ate", "ate_unaligned")
    for key, common in (("divergence_common", result.divergence_common), ("ate_common", result.ate_common)):
        if common is not None:
            found[key] = {"n": common.frames}
    by_frame = {
        "nees": None if evidence.nees is None else evidence.nees["pose"].to_numpy(),
        "nees_reference": None if evidence.difference is None else evidence.difference.nees,
        "sigma_ratio": None if evidence.sigma_ratio is None else evidence.sigma_ratio["position"].to_numpy(),
        "nis": evidence.nis_per_degree,
    }
    for key, values in by_frame.items():
        if values is not None:
            of_frames(np.asarray(np.isfinite(values), dtype=np.bool_), key)
    return {**found, **_of_observations(run, result), **_without_time(run, result)}


def _of_observations(run: Run, result: Result) -> dict[str, dict[str, float]]:
    """Observations, and the time of the frames that they are in."""
    t, table = run.problem.sequence.t, result.reprojection
    common = np.zeros(len(run.problem.excluded), dtype=np.bool_) if run.common is None else run.common
    parts = {
        "reprojection": table,
        "components": table,
        "reprojection_used": table[table["used"]],
        "reprojection_common": table[common[table["observation"]]],
    }
    return {
        key: {"n": len(part), "coverage": compare.time_coverage(t[np.unique(part["frame"])], t)}
        for key, part in parts.items()
    }


def _without_time(run: Run, result: Result) -> dict[str, dict[str, float]]:
    evidence = result.evidence
    counts = {"whitened": int(evidence.whitened["tracks"]), "moved_points": len(evidence.moved)}
    if evidence.map is not None:
        counts |= {"map": len(evidence.map), "map.median_sigmas": int(evidence.map["sigmas"].notna().sum())}
    if run.held_out is not None and result.name in run.held_out.ranking.index:
        counts["held_out"] = int(run.held_out.ranking.attrs["n"])
    return {key: {"n": n} for key, n in counts.items()}


def of_truth(run: Run) -> Mapping[str, float] | None:
    """The sample that errors to the truth rest on at best: the frames that have one; None without truth."""
    truth, t = run.problem.sequence.truth, run.problem.sequence.t
    return (
        None if truth is None else {"n": int(truth.known.sum()), "coverage": compare.time_coverage(t[truth.known], t)}
    )
