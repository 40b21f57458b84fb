"""Whether K belongs to the images of the observations: their size, and their field of view."""

import numpy as np

from fgbaseline.data.finding import Finding
from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import capitalized
from fgbaseline.geometry import FloatArray

MIN_OBSERVATIONS = 200
OUTER = (0.01, 0.99)
"""quantiles between which the observations span the image"""
CROPPED, OTHER = 1.6, 2.5
"""ratio of principal point and middle of the observations, beyond that of cropped images, and beyond any"""
SIMILAR = 1.7
"""ratio by which columns and rows may differ: a street fills the lower or upper part of an image"""
FIELDS = (0.01, 100.0)
"""span of the observations over the focal length: 0.6° to 179°"""


def size_ratio(sequence: Sequence) -> float:
    """Size of the images that K is of over that of the observations; 1 where they may be the same."""
    camera = sequence.camera
    if len(sequence.observations) < MIN_OBSERVATIONS:
        return 1.0
    middle = _span(sequence).mean(axis=0)
    if (middle <= 0.0).any():
        return 1.0
    columns, rows = np.array([camera.cu, camera.cv]) / middle
    beyond = min(columns, rows) > CROPPED or max(columns, rows) < 1.0 / CROPPED
    similar = beyond and 1.0 / SIMILAR < rows / columns < SIMILAR
    return float(np.sqrt(columns * rows)) if similar else 1.0


def doubt_of_intrinsics(sequence: Sequence) -> str:
    """Cause and remedy where K cannot be that of the observations, in words; empty where it can."""
    if len(sequence.observations) < MIN_OBSERVATIONS:
        return ""
    camera, ratio = sequence.camera, size_ratio(sequence)
    (left, top), (right, bottom) = _span(sequence)
    fields = (right - left) / camera.fu, (bottom - top) / camera.fv
    if max(fields) < FIELDS[0] or min(fields) > FIELDS[1]:
        return (
            f"the observations span {right - left:.4g} x {bottom - top:.4g} px, and the focal lengths in K are "
            f"{camera.fu:.4g} and {camera.fv:.4g} px: no camera has such a field of view; write K and features in "
            "pixels of the same images"
        )
    return f"{_mismatch(sequence)}; scale K or features" if not 1.0 / OTHER < ratio < OTHER else ""


def intrinsics_findings(sequence: Sequence) -> tuple[Finding, ...]:
    """A finding where K seems to be of images of another size."""
    ratio = size_ratio(sequence)
    if ratio == 1.0:
        return ()
    text = _mismatch(sequence)
    return (Finding("intrinsics", f"{capitalized(text)}.", ratio, ratio, "times", "the observed pixels"),)


def _mismatch(sequence: Sequence) -> str:
    """Principal point and middle of the observations, in words."""
    camera, (u, v) = sequence.camera, _span(sequence).mean(axis=0)
    return (
        f"the principal point in K is ({camera.cu:.0f}, {camera.cv:.0f}) px and the middle of the observations "
        f"({u:.0f}, {v:.0f}) px: K is of images about {size_ratio(sequence):.2g} times as large"
    )


def _span(sequence: Sequence) -> FloatArray:
    """Bounds (2, 2) of uL and vL, px, between which nearly all observations lie."""
    return np.quantile(sequence.observations.pixel[:, :2], OUTER, axis=0)
