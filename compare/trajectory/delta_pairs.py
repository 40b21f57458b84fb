"""Pairs of poses one delta apart: frames, seconds, meters of path, or degrees of rotation (as evo and RPE use them)."""

from enum import StrEnum

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, InputError, so3
from fgbaseline.geometry.path_length import distance_traveled

ROUNDING = 1e-9
"""tolerance as a share of a delta, for steps whose sum equals the delta up to rounding"""
TOLERANCE = 0.1
"""largest deviation from a delta for all pairs, as a share"""
AT_ONCE = 4_000_000
"""pairs per batch, to bound the memory"""


class Unit(StrEnum):
    """Unit of a delta."""

    FRAMES = "frames"
    SECONDS = "s"
    METERS = "m"
    DEGREES = "deg"


def pose_pairs(
    poses: FloatArray,
    t: FloatArray,
    delta: float,
    unit: Unit | str,
    *,
    all_pairs: bool = False,
    tolerance: float = TOLERANCE,
) -> IntArray:
    """Index pairs (m, 2) of poses (n, 4, 4) at stamps t (n,), s, that are one delta apart.

    Consecutive: each pair begins where the previous one ends, and ends at the first pose at least a delta away.
    All pairs: for each pose the later one whose distance in time or along the path is nearest to the delta, if within
    `tolerance` (a share of it; frames are counted exactly); for degrees every later pose whose orientation is a delta
    away within `tolerance`, the direct angle and not the accumulated one. Raises InputError where there is no pair.
    """
    unit = Unit(unit)
    if not (np.isfinite(delta) and delta > 0 and (unit is not Unit.FRAMES or float(delta).is_integer())):
        wanted = "a whole number above 0" if unit is Unit.FRAMES else "a number above 0"
        raise InputError(f"delta: expected {wanted} of {unit.value}, got {delta!r}")
    if unit is Unit.DEGREES and delta > 180:
        raise InputError(f"delta: no two orientations are {delta!r} degrees apart; give one of at most 180")
    if len(poses) < 2:
        raise InputError(f"delta: {len(poses)} poses have no pair; give a trajectory of at least two")
    if all_pairs and unit is Unit.DEGREES:
        pairs = turned_pairs(poses[:, :3, :3], np.deg2rad(delta), np.deg2rad(delta) * tolerance)
    else:
        along = _coordinate(poses, t, unit)
        miss = 0.0 if unit is Unit.FRAMES else tolerance
        pairs = nearest_delta_pairs(along, delta, miss) if all_pairs else chained_pairs(along, delta)
    if len(pairs) == 0:
        raise InputError(
            f"delta: no two of the {len(poses)} poses are {delta:g} {unit.value} apart; give a smaller delta"
        )
    return pairs


def chained_pairs(along: FloatArray, delta: float) -> IntArray:
    """Consecutive index pairs (m, 2) into rising `along` (n,): from each end to the first entry at least a delta on."""
    following = np.searchsorted(along, along + delta * (1.0 - ROUNDING))
    following = np.maximum(following, np.arange(len(along)) + 1).tolist()  # a delta may be below rounding
    chain = [0]
    while (end := following[chain[-1]]) < len(along):
        chain.append(end)
    return np.stack([chain[:-1], chain[1:]], axis=1).astype(np.int64)


def nearest_delta_pairs(along: FloatArray, delta: float, tolerance: float) -> IntArray:
    """Index pairs (m, 2) into rising `along` (n,): from each entry to the (first) later one nearest to a delta on."""
    start = np.arange(len(along) - 1)
    after = np.clip(np.searchsorted(along, along[:-1] + delta * (1.0 - ROUNDING)), start + 1, len(along) - 1)
    before = np.maximum(np.searchsorted(along, along[np.maximum(after - 1, start + 1)]), start + 1)
    miss_after, miss_before = (np.abs(along[end] - along[start] - delta) for end in (after, before))
    end = np.where(miss_before <= miss_after + delta * ROUNDING, before, after)
    near = np.minimum(miss_before, miss_after) <= delta * (tolerance + ROUNDING)
    return np.stack([start[near], end[near]], axis=1).astype(np.int64)


def turned_pairs(rotations: FloatArray, angle: float, tolerance: float) -> IntArray:
    """Index pairs (m, 2) of all rotations (n, 3, 3) whose relative angle is `angle` within `tolerance`, rad.

    Cost: n^2 / 2 pairs in batches, nine multiplications each.
    """
    n, flat = len(rotations), rotations.reshape(-1, 9)
    most, least = (np.cos(np.clip(edge, 0.0, np.pi)) for edge in (angle - tolerance, angle + tolerance))
    slack = 1e-12  # the cosine's rounding; the angle itself decides among the candidates
    found = []
    block = max(1, AT_ONCE // n)
    for first in range(0, n - 1, block):
        traces = flat[first : first + block] @ flat[first:].T
        i, j = np.nonzero((traces >= 1.0 + 2.0 * least - slack) & (traces <= 1.0 + 2.0 * most + slack))
        later = j > i
        found.append(np.stack([i[later], j[later]], axis=1) + first)
    pairs = np.concatenate(found) if found else np.empty((0, 2), np.int64)
    apart = so3.rotation_angle(np.swapaxes(rotations[pairs[:, 0]], 1, 2) @ rotations[pairs[:, 1]])
    return pairs[np.abs(apart - angle) <= tolerance + ROUNDING * angle]


def _coordinate(poses: FloatArray, t: FloatArray, unit: Unit) -> FloatArray:
    if unit is Unit.FRAMES:
        return np.arange(len(poses), dtype=np.float64)
    if unit is Unit.SECONDS:
        return np.asarray(t - t[0])
    if unit is Unit.METERS:
        return distance_traveled(poses[:, :3, 3])
    turns = np.swapaxes(poses[:-1, :3, :3], 1, 2) @ poses[1:, :3, :3]
    return np.asarray(np.rad2deg(np.concatenate([[0.0], np.cumsum(so3.rotation_angle(turns))])))
