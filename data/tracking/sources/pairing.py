"""Pairs of images by their time stamps."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...formats.recordings.ground_truth import match_stamps
from ...observations import IntArray
from ...wording import plural

APART = 0.1
"""largest interval between the images of a pair, as a share of the median interval between frames"""
STAMP_DIGITS = {10: 10**9, 13: 10**6, 16: 10**3, 19: 1}
"""ns in the unit of whole stamps since 1970, by their number of digits"""


class Paired(NamedTuple):
    """Images that form pairs."""

    stamp: IntArray
    """(T,) ns, of the left images, strictly rising"""
    left: IntArray
    """(T,) indices into the left images"""
    right: IntArray
    remarks: tuple[str, ...]

    @property
    def t(self) -> FloatArray:
        """Stamps (T,), s."""
        return seconds(self.stamp)


def seconds(stamp: IntArray) -> FloatArray:
    """Stamps (n,), s, of stamps in ns."""
    return np.array([each / 10**9 for each in stamp.tolist()])


def pair(left: IntArray, right: IntArray, source: str) -> Paired:
    """Pairs of the images with stamps left (n,) and right (m,), ns, strictly rising.

    Images without a partner are counted in a remark. Raises InputError where fewer than two pairs are left.
    """
    start = min(int(left[0]), int(right[0]))
    first, second = ((stamps - start).astype(np.float64) * 1e-9 for stamps in (left, right))
    a, b = match_stamps(first, second) if min(len(left), len(right)) > 1 else (np.arange(0), np.arange(0))
    near = np.abs(first[a] - second[b]) <= APART * np.median(np.diff(first)) if len(a) else np.zeros(0, dtype=np.bool_)
    a, b = a[near], b[near]
    if len(a) < 2:
        raise InputError(
            f"{source}: {plural(len(a), 'image')} of {len(left)} on the left and {len(right)} on the right form pairs; "
            "their stamps have to agree within a tenth of the interval between frames"
        )
    alone = len(left) + len(right) - 2 * len(a)
    text = f"{plural(alone, 'image')} without a partner: skipped ({len(left)} on the left, {len(right)} on the right)."
    return Paired(left[a], a, b, (text,) if alone else ())


def stamps_of_names(files: Sequence[Path]) -> IntArray | None:
    """Stamps (n,), ns, that are the names of files; None where they are none."""
    stamps = []
    for file in files:
        whole, _, part = file.stem.partition(".")
        if not (whole.isdecimal() and len(whole) in STAMP_DIGITS and (part.isdecimal() or not part)):
            return None
        unit = STAMP_DIGITS[len(whole)]
        stamps.append(int(whole) * unit + (int(part[:9].ljust(9, "0")) * unit // 10**9 if part else 0))
    return np.array(stamps, dtype=np.int64)
