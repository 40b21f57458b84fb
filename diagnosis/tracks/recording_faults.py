"""Faults that make a recording or all its observations unusable, by cause."""

import numpy as np

from fgbaseline.data.sequence import Sequence
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray, disparity

from .intrinsics_check import doubt_of_intrinsics

SWAPPED = 0.9
"""share of the disparities that are negative"""
MIN_OBSERVATIONS = 20
"""number of observations from which on a share is meaningful"""
LONGEST_GAP, MANY_INTERVALS = 1000.0, 1e4
"""s, and median intervals: a gap beyond both is bridged by no velocity and no inertial sample"""


def unusable(sequence: Sequence) -> str:
    """Cause and remedy, in a sentence without its full stop; empty where the recording is usable."""
    gap = _gap("time_stamps", "frame", sequence.t) or (
        "" if sequence.imu is None else _gap("imu_time_stamps", "sample", sequence.imu.t)
    )
    if gap:
        return gap
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
    return doubt_of_intrinsics(sequence)


def _gap(key: str, what: str, t: FloatArray) -> str:
    dt = np.diff(t)
    k = int(np.argmax(dt))
    if dt[k] < max(LONGEST_GAP, MANY_INTERVALS * float(np.median(dt))):
        return ""
    return (
        f"{key}: {dt[k]:.4g} s pass between {what} {k} and {what} {k + 1}, while the median interval is "
        f"{float(np.median(dt)):.3g} s: a stray stamp, or two recordings in one file; split it there"
    )
