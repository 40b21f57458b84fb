"""How wrong the motions between poses are: what no alignment and no early mistake can hide."""

import pandas as pd

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import InputError

from .association import Matched
from .ate_rpe import Difference, motion_difference
from .delta_pairs import TOLERANCE, Unit, pose_pairs
from .path import distance_travelled

OF_MOTIONS = (
    Difference.TRANSLATION,
    Difference.ROTATION_DEG,
    Difference.ROTATION_CHORD,
    Difference.POSE,
    Difference.DISTANCE,
    Difference.DISTANCE_PERCENT,
)


def relative_errors(
    matched: Matched,
    delta: float,
    unit: Unit | str,
    *,
    all_pairs: bool = False,
    tolerance: float = TOLERANCE,
    from_reference: bool = True,
) -> pd.DataFrame:
    """One row per pair of poses that are `delta` apart (see `pose_pairs`), with the columns

    `start`, `end` (indices of the matched poses), `t` (s, of the start), `seconds` and `metres` (of the reference's
    path) between them, and what `Difference` defines of the motion from start to end: `translation` (m, in the frame
    of the starting body), `rotation_deg`, `rotation_chord`, `pose`, `distance` (m) and `distance_percent`.
    """
    reference, estimate = matched.reference, matched.estimate
    pairs = matched_pairs(matched, delta, unit, all_pairs=all_pairs, tolerance=tolerance, from_reference=from_reference)
    travelled = distance_travelled(reference.position)
    start, end = pairs[:, 0], pairs[:, 1]
    columns = {
        what.value: motion_difference(estimate.world_T_body, reference.world_T_body, pairs, what) for what in OF_MOTIONS
    }
    return pd.DataFrame(
        {
            "start": start,
            "end": end,
            "t": reference.t[start],
            "seconds": reference.t[end] - reference.t[start],
            "metres": travelled[end] - travelled[start],
            **columns,
        }
    )


def matched_pairs(
    matched: Matched,
    delta: float,
    unit: Unit | str,
    *,
    all_pairs: bool = False,
    tolerance: float = TOLERANCE,
    from_reference: bool = True,
) -> IntArray:
    """(m, 2) the pairs `pose_pairs` finds on the reference, so that they are the same for every estimate; or on the
    estimate. Raises InputError for seconds where there are no stamps."""
    path = matched.reference if from_reference else matched.estimate
    if Unit(unit) is Unit.SECONDS:
        require_stamps(matched)
    return pose_pairs(path.world_T_body, path.t, delta, unit, all_pairs=all_pairs, tolerance=tolerance)


def require_stamps(matched: Matched) -> None:
    """Raises InputError where reference or estimate has no time stamps."""
    for path in (matched.reference, matched.estimate):
        if not path.stamped:
            raise InputError(f"{path.source or path.name}: it has no time stamps, so nothing can be said per second")
