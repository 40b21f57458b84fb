"""Faults that make all observations of a recording unusable, by their cause."""

import numpy as np

from fgbaseline.data.plural import plural
from fgbaseline.data.sequence import Sequence
from fgbaseline.geometry import disparity

SWAPPED = 0.9
"""share of the disparities that are negative"""
MIN_OBSERVATIONS = 20
"""from which on a share is meaningful"""


def unusable(sequence: Sequence) -> str:
    """Cause and remedy, in a sentence without its full stop; empty where observations are usable."""
    o = sequence.observations
    n = len(o)
    if n == 0:
        return "the recording has no observations"
    negative = int(np.sum(disparity(o.pixel) < 0.0))
    if n >= MIN_OBSERVATIONS and negative > SWAPPED * n:
        return (
            f"{negative:,} of {plural(n, 'observation')} have a negative disparity uL - uR: left and right camera "
            "are swapped; write uL, vL, uR, vR in this order, uL being of the camera that imu_T_cam gives"
        )
    if n >= MIN_OBSERVATIONS and int(o.counts(sequence.n_landmarks).max()) == 1:
        return (
            f"every landmark is seen in one frame only ({plural(n, 'observation')} of as many landmarks), so that no "
            "track ties one frame to another; give a landmark the same column of features in every frame that sees it"
        )
    return ""
