"""Absolute trajectory error (ATE) and relative pose error (RPE) (Sturm et al., 2012).

Both measure E = A^-1 B: for ATE A and B are a pose of the reference and of the estimate, for RPE motions between two
poses. `PoseRelation` names the scalar measure of E, as in evo.
"""

from enum import StrEnum
from typing import TYPE_CHECKING, TypedDict, Unpack

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, InputError, so3
from fgbaseline.geometry.path_length import distance_traveled

from ..column_tables import Columns, to_frame
from .association import MatchedTrajectories
from .delta_pairs import TOLERANCE, Unit, pose_pairs

if TYPE_CHECKING:
    import pandas as pd


class PoseRelation(StrEnum):
    """Scalar measure of E = A^-1 B, the difference between two poses (ATE) or two motions (RPE)."""

    TRANSLATION = "translation"
    """norm of the translation of E, m"""
    ROTATION = "rotation"
    """angle of the rotation of E, rad"""
    ROTATION_DEG = "rotation_deg"
    """angle of the rotation of E, deg"""
    ROTATION_CHORD = "rotation_chord"
    """Frobenius norm of R_E - I: 2 sqrt(2) sin(angle / 2), no unit"""
    POSE = "pose"
    """Frobenius norm of E - I: mixes m with the unitless chord, so it depends on the unit of length"""
    DISTANCE = "distance"
    """difference of the distances between start and end position, m; motions only"""
    DISTANCE_PERCENT = "distance_percent"
    """DISTANCE over the reference's distance, %; NaN where that is zero; motions only"""


def absolute_pose_error(estimate: FloatArray, reference: FloatArray, what: PoseRelation | str) -> FloatArray:
    """Errors (n,) of poses (n, 4, 4) against reference poses (n, 4, 4), in the unit of `what`.

    Raises InputError for the measures that only motions have, `distance` and `distance_percent`.
    """
    what = PoseRelation(what)
    if what in (PoseRelation.DISTANCE, PoseRelation.DISTANCE_PERCENT):
        raise InputError(
            f"{what}: defined for motions (RPE) only; for poses choose {', '.join(POSE_COLUMNS)} or rotation"
        )
    apart = estimate[:, :3, 3] - reference[:, :3, 3]
    return _measured(apart, estimate[:, :3, :3], reference[:, :3, :3], what)


def relative_pose_error(
    estimate: FloatArray, reference: FloatArray, pairs: IntArray, what: PoseRelation | str
) -> FloatArray:
    """Errors (m,) of motions between pairs (m, 2) of poses (n, 4, 4) against the reference's; unit: that of `what`."""
    what = PoseRelation(what)
    i, j = pairs[:, 0], pairs[:, 1]
    steps = [poses[j, :3, 3] - poses[i, :3, 3] for poses in (estimate, reference)]
    if what in (PoseRelation.DISTANCE, PoseRelation.DISTANCE_PERCENT):
        length, reference_length = (np.sqrt(np.einsum("ti,ti->t", step, step)) for step in steps)
        apart = np.abs(length - reference_length)
        if what is PoseRelation.DISTANCE:
            return np.asarray(apart)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(reference_length > 0, 100.0 * apart / reference_length, np.nan)
    R, R_ref = (np.swapaxes(poses[i, :3, :3], 1, 2) for poses in (estimate, reference))
    in_start, in_start_ref = ((turn @ step[:, :, None])[:, :, 0] for turn, step in zip((R, R_ref), steps, strict=True))
    if what is PoseRelation.TRANSLATION:
        return np.asarray(np.linalg.norm(in_start - in_start_ref, axis=1))
    return _measured(in_start - in_start_ref, R @ estimate[j, :3, :3], R_ref @ reference[j, :3, :3], what)


def _measured(apart: FloatArray, R: FloatArray, R_ref: FloatArray, what: PoseRelation) -> FloatArray:
    # Norms are invariant to a common rotation, so only the angle needs E itself.
    squared = np.einsum("ti,ti->t", apart, apart)
    if what is PoseRelation.TRANSLATION:
        return np.asarray(np.sqrt(squared))
    if what in (PoseRelation.ROTATION, PoseRelation.ROTATION_DEG):
        angle = so3.rotation_angle(np.swapaxes(R_ref, 1, 2) @ R)
        return np.rad2deg(angle) if what is PoseRelation.ROTATION_DEG else angle
    chord = np.einsum("tij,tij->t", R - R_ref, R - R_ref)
    if what is PoseRelation.ROTATION_CHORD:
        return np.asarray(np.sqrt(chord))
    return np.asarray(np.sqrt(squared + chord))


POSE_COLUMNS = (PoseRelation.TRANSLATION, PoseRelation.ROTATION_DEG, PoseRelation.ROTATION_CHORD, PoseRelation.POSE)


def absolute_errors(matched: MatchedTrajectories) -> "pd.DataFrame":
    """Table of `absolute_error_columns`."""
    return to_frame(absolute_error_columns(matched), "pose_index")


def absolute_error_columns(matched: MatchedTrajectories) -> Columns:
    """ATE as columns, a row for each pair of poses, after the alignment that `matched.caption` names.

    `t` is the reference's stamp, s; `translation` (m; its RMSE is the ATE of Sturm et al., 2012), `rotation_deg`,
    `rotation_chord` and `pose` are measures of `PoseRelation`.
    """
    estimate, reference = matched.estimate.world_T_body, matched.reference.world_T_body
    columns = {what.value: absolute_pose_error(estimate, reference, what) for what in POSE_COLUMNS}
    return {"t": matched.reference.t, **columns}


MOTION_COLUMNS = (
    PoseRelation.TRANSLATION,
    PoseRelation.ROTATION_DEG,
    PoseRelation.ROTATION_CHORD,
    PoseRelation.POSE,
    PoseRelation.DISTANCE,
    PoseRelation.DISTANCE_PERCENT,
)


class Pairing(TypedDict, total=False):
    """Choice of pairs of poses: see `matched_pairs`."""

    all_pairs: bool
    """False by default: consecutive pairs, end to end"""
    tolerance: float
    """share of the delta, `TOLERANCE` by default"""
    from_reference: bool
    """True by default: pairs of the reference, not of the estimate"""


def relative_errors(
    matched: MatchedTrajectories, delta: float, unit: Unit | str, **pairing: Unpack[Pairing]
) -> "pd.DataFrame":
    """Table of `relative_error_columns`."""
    return to_frame(relative_error_columns(matched, delta, unit, **pairing))


def relative_error_columns(
    matched: MatchedTrajectories, delta: float, unit: Unit | str, **pairing: Unpack[Pairing]
) -> Columns:
    """RPE as columns, a row for each pair of poses that are `delta` apart (see `matched_pairs`).

    `start` and `end` are indices of the matched poses, `t` is the stamp of the start, s; `seconds` and `meters` lie
    between them on the reference's path. The others are measures of `PoseRelation` of the motion from start to end:
    `translation` (m, in the body frame of the start), `rotation_deg`, `rotation_chord`, `pose`, `distance` (m) and
    `distance_percent`.
    """
    reference, estimate = matched.reference, matched.estimate
    pairs = matched_pairs(matched, delta, unit, **pairing)
    traveled = distance_traveled(reference.position)
    start, end = pairs[:, 0], pairs[:, 1]
    columns = {
        what.value: relative_pose_error(estimate.world_T_body, reference.world_T_body, pairs, what)
        for what in MOTION_COLUMNS
    }
    return {
        "start": start,
        "end": end,
        "t": reference.t[start],
        "seconds": reference.t[end] - reference.t[start],
        "meters": traveled[end] - traveled[start],
        **columns,
    }


def matched_pairs(
    matched: MatchedTrajectories,
    delta: float,
    unit: Unit | str,
    *,
    all_pairs: bool = False,
    tolerance: float = TOLERANCE,
    from_reference: bool = True,
) -> IntArray:
    """Pairs (m, 2) of `pose_pairs` on the reference, hence equal for every estimate, or on the estimate itself.

    Raises InputError for seconds without time stamps.
    """
    path = matched.reference if from_reference else matched.estimate
    if Unit(unit) is Unit.SECONDS:
        require_stamps(matched)
    return pose_pairs(path.world_T_body, path.t, delta, unit, all_pairs=all_pairs, tolerance=tolerance)


def require_stamps(matched: MatchedTrajectories) -> None:
    """Raises InputError where reference or estimate has no time stamps."""
    for path in (matched.reference, matched.estimate):
        if not path.stamped:
            raise InputError(
                f"{path.source or path.name}: it has no time stamps, which drift and RPE over seconds need"
            )
