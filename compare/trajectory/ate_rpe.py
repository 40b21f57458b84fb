"""By how much two poses, or two motions, differ: one number for each pair, by what it looks at."""

from enum import StrEnum

import numpy as np

from fgbaseline.data.observations import IntArray
from fgbaseline.geometry import FloatArray, so3


class Difference(StrEnum):
    """What of a pose is looked at. E is what takes one pose (or motion) to the other: E = A^-1 B."""

    TRANSLATION = "translation"
    """|translation of E|, m"""
    ROTATION = "rotation"
    """the angle of E's rotation, rad"""
    ROTATION_DEG = "rotation_deg"
    """the same, deg"""
    ROTATION_CHORD = "rotation_chord"
    """Frobenius norm of R_E - I: 2 sqrt(2) sin(angle / 2), no unit"""
    POSE = "pose"
    """Frobenius norm of E - I: mixes metres with the chord, so it depends on the unit of length"""
    DISTANCE = "distance"
    """the difference of how far it is from one position to the other, m; of motions only"""
    DISTANCE_PERCENT = "distance_percent"
    """the same as a share of the reference's, %; NaN where that stands; of motions only"""


def absolute_difference(estimate: FloatArray, reference: FloatArray, what: Difference | str) -> FloatArray:
    """(n,) difference of poses (n, 4, 4) from the reference's (n, 4, 4).

    The norms do not change when both are turned, so only angles need E itself.
    """
    what = Difference(what)
    apart = estimate[:, :3, 3] - reference[:, :3, 3]
    return _measured(apart, estimate[:, :3, :3], reference[:, :3, :3], what)


def motion_difference(
    estimate: FloatArray, reference: FloatArray, pairs: IntArray, what: Difference | str
) -> FloatArray:
    """(m,) difference of the motions between pairs (m, 2) of poses (n, 4, 4) from the reference's (n, 4, 4)."""
    what = Difference(what)
    i, j = pairs[:, 0], pairs[:, 1]
    steps = [poses[j, :3, 3] - poses[i, :3, 3] for poses in (estimate, reference)]
    if what in (Difference.DISTANCE, Difference.DISTANCE_PERCENT):
        length, reference_length = (np.sqrt(np.einsum("ti,ti->t", step, step)) for step in steps)
        apart = np.abs(length - reference_length)
        if what is Difference.DISTANCE:
            return np.asarray(apart)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(reference_length > 0, 100.0 * apart / reference_length, np.nan)
    R, R_ref = (np.swapaxes(poses[i, :3, :3], 1, 2) for poses in (estimate, reference))
    seen, seen_ref = ((turn @ step[:, :, None])[:, :, 0] for turn, step in zip((R, R_ref), steps, strict=True))
    if what is Difference.TRANSLATION:
        return np.asarray(np.linalg.norm(seen - seen_ref, axis=1))
    return _measured(seen - seen_ref, R @ estimate[j, :3, :3], R_ref @ reference[j, :3, :3], what)


def _measured(apart: FloatArray, R: FloatArray, R_ref: FloatArray, what: Difference) -> FloatArray:
    squared = np.einsum("ti,ti->t", apart, apart)
    if what in (Difference.TRANSLATION, Difference.DISTANCE):
        return np.asarray(np.sqrt(squared))
    if what in (Difference.ROTATION, Difference.ROTATION_DEG):
        angle = so3.rotation_angle(np.swapaxes(R_ref, 1, 2) @ R)
        return np.rad2deg(angle) if what is Difference.ROTATION_DEG else angle
    chord = np.einsum("tij,tij->t", R - R_ref, R - R_ref)
    if what is Difference.ROTATION_CHORD:
        return np.asarray(np.sqrt(chord))
    if what is Difference.POSE:
        return np.asarray(np.sqrt(squared + chord))
    raise ValueError(f"{what} is not one of poses, but of motions")
