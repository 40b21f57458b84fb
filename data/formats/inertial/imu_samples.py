"""Raw samples from a file: doubled ones are left out and counted, and what cannot be used is refused with its cause."""

from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...finding import Finding
from ...imu import ImuNoise, ImuSamples
from ...time_unit import lost_digits
from ...wording import noun, plural

MOST_DOUBLED = 0.05
"""share of the samples that may repeat the stamp before; with more, the stamps lost their digits"""
STRAY = 1000.0
"""median intervals from a first stamp of exactly 0 to the next, from which on it is a stray value"""
NO_GRAVITY = 0.35
"""m/s^2, median specific force below which nothing but noise is left of it in any unit"""


class RawSamples(NamedTuple):
    """Samples as read from a file."""

    samples: ImuSamples
    remarks: tuple[str, ...]
    findings: tuple[Finding, ...]


def imu_samples(
    t: FloatArray, rate: FloatArray, force: FloatArray, noise: ImuNoise, gravity: float
) -> tuple[ImuSamples, tuple[Finding, ...]]:
    """Samples at stamps t (M,) with rates and specific forces (M, 3), without those that repeat the stamp before.

    Raises InputError as `ImuSamples`, for many repeated stamps, and for specific forces without gravity.
    """
    kept = np.append(True, np.diff(t) != 0.0) if len(t) else np.zeros(0, dtype=np.bool_)
    doubled = int((~kept).sum())
    if doubled > max(1, MOST_DOUBLED * len(t)):
        cause = lost_digits(t)
        advice = f", so their digits are lost: {cause}" if cause else "; write the time of each sample, with all digits"
        raise InputError(f"imu_time_stamps: {doubled} of {len(t)} samples repeat the stamp before{advice}")
    if len(t) > 2 and t[0] == 0.0 and t[1] > STRAY * float(np.median(np.diff(t))):
        raise InputError(
            f"imu_time_stamps: the stamp of sample 0 is 0, while the next is {float(t[1])!r}: a value that was never "
            "set; write its time, or remove the sample"
        )
    samples = ImuSamples(t[kept], rate[kept], force[kept], noise, gravity)
    median = float(np.median(np.linalg.norm(samples.specific_force, axis=1)))
    if median < NO_GRAVITY:
        raise InputError(
            f"imu_linear_acceleration: its median magnitude is {median:.3g}, so gravity was taken off; write the "
            "specific force as measured, +9.8 m/s^2 upward at rest"
        )
    if not doubled:
        return samples, ()
    which = ", ".join(str(k) for k in np.flatnonzero(~kept)[:4].tolist()) + (" and more" if doubled > 4 else "")
    have = noun(doubled, "repeats", "repeat")
    text = f"{plural(doubled, 'inertial sample')} {have} the stamp before ({which}): the first of each is kept."
    return samples, (Finding("doubled_samples", text, doubled, 0, "samples", "counted"),)
