"""Drift rates: error of the motion per meter of path and per second."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, InputError
from fgbaseline.geometry.path_length import distance_traveled

from ..statistics.block_bootstrap import REPETITIONS, bootstrapped
from ..statistics.bootstrap_resampling import CONFIDENCE
from .association import MatchedTrajectories
from .ate_rpe import PoseRelation, relative_pose_error, require_stamps
from .delta_pairs import nearest_delta_pairs

if TYPE_CHECKING:
    import pandas as pd

SHARE = 0.1
"""share of the path and of its duration: the default interval of drift, or one step where that is longer"""
TOLERANCE = 0.5
"""largest deviation of a stretch from the requested interval, as a share; rates divide by the stretch's own length"""


class Rate(NamedTuple):
    """Mean drift with its interval."""

    value: float
    low: float
    high: float
    unit: str
    over: str
    """interval of the stretches, with its unit"""
    n: int
    """number of stretches (pairs of poses)"""


def drift(
    matched: MatchedTrajectories,
    meters: float | None = None,
    seconds: float | None = None,
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
) -> "pd.DataFrame":
    """Table of `drift_rates`: one row per rate, indexed by `quantity`."""
    import pandas as pd

    rates = drift_rates(matched, meters, seconds, confidence=confidence, repetitions=repetitions, seed=seed)
    return pd.DataFrame(list(rates.values()), index=pd.Index(rates, name="quantity"), columns=list(Rate._fields))


def drift_rates(
    matched: MatchedTrajectories,
    meters: float | None = None,
    seconds: float | None = None,
    *,
    confidence: float = CONFIDENCE,
    repetitions: int = REPETITIONS,
    seed: int = 0,
) -> Mapping[str, Rate]:
    """Mean error of the motion over `meters` of the reference's path, per meter, and over `seconds`, per second.

    Quantities are translation and rotation per meter (%, deg/m) and per second (m/s, deg/s; not without stamps), over
    `n` overlapping stretches from each pose to the later one nearest to the interval `over`, each divided by its own
    length; and `end translation` (%) and `end rotation` (deg/m), the error of the motion from first to last pose over
    the length of the path. Each has its `value`, and the bounds `low` and `high` of a block bootstrap.

    Raises InputError where the reference does not move or no stretch has the requested length.
    """
    reference = matched.reference
    traveled = distance_traveled(reference.position)
    path = float(traveled[-1])
    if len(reference) < 2 or path == 0.0:
        raise InputError(f"{reference.source or reference.name}: it stands still, so it has no drift per meter")
    meters = _default(traveled) if meters is None else meters
    pairs = _stretches(traveled, meters, "m")
    over = traveled[pairs[:, 1]] - traveled[pairs[:, 0]]
    rates = [
        ("translation", "%", 100.0, PoseRelation.TRANSLATION, pairs, over, f"{meters:.4g} m"),
        ("rotation", "deg/m", 1.0, PoseRelation.ROTATION_DEG, pairs, over, f"{meters:.4g} m"),
    ]
    if seconds is not None:
        require_stamps(matched)
    if reference.stamped and matched.estimate.stamped:
        t = reference.t - reference.t[0]
        seconds = _default(t) if seconds is None else seconds
        pairs = _stretches(t, seconds, "s")
        over = t[pairs[:, 1]] - t[pairs[:, 0]]
        rates += [
            ("translation per second", "m/s", 1.0, PoseRelation.TRANSLATION, pairs, over, f"{seconds:.4g} s"),
            ("rotation per second", "deg/s", 1.0, PoseRelation.ROTATION_DEG, pairs, over, f"{seconds:.4g} s"),
        ]
    whole, path_length = np.array([[0, len(reference) - 1]]), np.array([path])
    rates += [
        ("end translation", "%", 100.0, PoseRelation.TRANSLATION, whole, path_length, f"{path:.4g} m"),
        ("end rotation", "deg/m", 1.0, PoseRelation.ROTATION_DEG, whole, path_length, f"{path:.4g} m"),
    ]
    poses, truth = matched.estimate.world_T_body, reference.world_T_body
    found = {}
    for quantity, unit, factor, what, stretch, length, base in rates:
        errors = factor * relative_pose_error(poses, truth, stretch, what) / length
        mean = bootstrapped(errors, of=("mean",), confidence=confidence, repetitions=repetitions, seed=seed)["mean"]
        found[quantity] = Rate(*mean, unit, base, len(stretch))
    return found


def _default(along: FloatArray) -> float:
    return max(SHARE * float(along[-1]), float(np.diff(along).max()))


def _stretches(along: FloatArray, wanted: float, unit: str) -> IntArray:
    pairs = nearest_delta_pairs(along, wanted, TOLERANCE) if wanted > 0 else np.empty((0, 2), np.int64)
    if len(pairs) == 0:
        raise InputError(f"drift: no two poses are {wanted:g} {unit} apart, of {along[-1]:.4g} {unit} in all")
    return pairs
