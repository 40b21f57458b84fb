"""Sample sizes that the values of a run rest on, which decide whether a limit can be judged."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from fgbaseline import compare
from fgbaseline.data.observations import BoolArray
from fgbaseline.geometry import FloatArray
from fgbaseline.geometry.strapdown import BLOCKS

from .consistency.state_nees import QUANTITIES
from .estimate_comparison import InertialEvidence, Result, Run, known


def samples(run: Run, result: Result) -> dict[str, dict[str, float]]:
    """First key of a metric's path -> its sample size `n`, and the `coverage` of the recording's time.

    The unit of n is frames, except observations for reprojection, landmarks for the map and otherwise tracks. Landmarks
    and tracks are not spread over time, and have no coverage.
    """
    t, evidence, table = run.problem.sequence.t, result.evidence, result.reprojection
    ranking = None if run.held_out is None else run.held_out.ranking
    common = np.zeros(len(run.problem.excluded), dtype=np.bool_) if run.common is None else run.common
    truth = _of_frames(t, None if result.truth is None else known(result.truth))
    every: dict[str, dict[str, float] | None] = {
        "divergence": _of_frames(t, None if result.divergence is None else known(result.divergence)),
        "ate": truth,
        "ate_unaligned": truth,
        "divergence_common": None if result.divergence_common is None else {"n": result.divergence_common.frames},
        "ate_common": None if result.ate_common is None else {"n": result.ate_common.frames},
        "nees": _of_values(t, result.nees),
        "nees_reference": _of_values(t, None if evidence.difference is None else evidence.difference.nees),
        "sigma": _of_values(t, evidence.sigma.position),
        "sigma_ratio": _of_values(t, None if evidence.sigma_ratio is None else evidence.sigma_ratio["position"]),
        "nis": _of_values(t, evidence.nis_per_degree),
        "reprojection": _of_observations(t, table),
        "components": _of_observations(t, table),
        "reprojection_used": _of_observations(t, table[table["used"]]),
        "reprojection_common": _of_observations(t, table[common[table["observation"]]]),
        "whitened": {"n": int(evidence.whitened["tracks"])},
        "moved_points": {"n": len(evidence.moved)},
        "map": None if evidence.map is None else {"n": len(evidence.map)},
        "map.median_sigmas": None if evidence.map is None else {"n": int(evidence.map["sigmas"].notna().sum())},
        "held_out": None if ranking is None or result.name not in ranking.index else {"n": int(ranking.attrs["n"])},
    }
    if result.inertial is not None:
        every |= _inertial(t, result.inertial)
    return {key: sample for key, sample in every.items() if sample is not None}


def _inertial(t: FloatArray, inertial: InertialEvidence) -> dict[str, dict[str, float] | None]:
    """Frames of the velocity and the biases by their errors, and of the NEES of the state and of each block."""
    values: dict[str, ArrayLike] = {}
    if inertial.errors is not None and inertial.nees is not None:
        values |= {name: inertial.errors[name] for name in QUANTITIES} | {"nees_state": inertial.nees["state"]}
        values |= {"velocity_unaligned": inertial.errors["velocity"]}
        values |= {f"nees_state.{name}": inertial.nees[name] for name in BLOCKS}
    if inertial.divergence is not None:
        values |= {f"{name}_divergence": inertial.divergence[name] for name in QUANTITIES}
    return {key: _of_values(t, column) for key, column in values.items()}


def truth_sample(run: Run) -> Mapping[str, float] | None:
    """Largest possible sample of errors against the truth, the frames that have one; None without truth."""
    truth = run.problem.sequence.truth
    return _of_frames(run.problem.sequence.t, None if truth is None else truth.known)


def insufficient_truth(run: Run) -> bool:
    """Whether there is ground truth, but for too few frames or too little of the time to judge by."""
    sample = truth_sample(run)
    return sample is not None and compare.is_insufficient(sample, compare.MIN_SAMPLE_SIZE, compare.MIN_COVERAGE)


def _of_frames(t: FloatArray, frames: BoolArray | None) -> dict[str, float] | None:
    return None if frames is None else {"n": int(frames.sum()), "coverage": compare.time_coverage(t[frames], t)}


def _of_values(t: FloatArray, values: ArrayLike | None) -> dict[str, float] | None:
    """Sample of the frames in which values (T,) are finite."""
    return None if values is None else _of_frames(t, np.isfinite(np.asarray(values, dtype=np.float64)))


def _of_observations(t: FloatArray, table: pd.DataFrame) -> dict[str, float]:
    return {"n": len(table), "coverage": compare.time_coverage(t[np.unique(table["frame"])], t)}
