"""Time stamps of a recording's frames: repeated ones are left out, other faults are rejected with their cause.

Stamps of a long clock that lost digits repeat each other (`time_unit.lost_digits`), or jump by the rounding.
"""

from typing import NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...finding import Finding
from ...observations import BoolArray, IntArray, Observations
from ...sequence import Truth
from ...time_unit import COARSE, lost_digits
from ...wording import per_cent
from ..files.field_checks import finite_stamps

MOST_REPEATED = 0.05
"""share of the frames that may repeat the stamp before (one always may); with more, the stamps lost their digits"""
STRAY = 1000.0
"""median intervals from a first stamp of exactly 0 to the next, from which on it is a stray value"""


class FrameStamps(NamedTuple):
    """Frames of a file with a time stamp of their own."""

    t: FloatArray
    """(T,) as recorded, strictly rising"""
    kept: BoolArray
    """(m,) mask of these frames in the file"""
    findings: tuple[Finding, ...]

    @property
    def left_out(self) -> tuple[int, ...]:
        """Frames of the file that are left out."""
        return tuple(np.flatnonzero(~self.kept).tolist())

    def observations(self, o: Observations) -> Observations:
        """Observations of the kept frames, renumbered."""
        if self.kept.all():
            return o
        number = np.cumsum(self.kept) - 1
        chosen = self.kept[o.frame]
        return Observations(number[o.frame[chosen]], o.landmark[chosen], o.pixel[chosen])

    def truth(self, truth: Truth | None) -> Truth | None:
        """Stamps of the kept frames."""
        return truth if truth is None else truth.of_frames(self.kept)


def read_stamps(key: str, array: FloatArray) -> FrameStamps:
    """The stamps of an array (1, T) or (T,).

    A frame whose stamp repeats that of the frame before is left out and counted. Raises InputError unless the others
    are finite, rising and two or more, with the cause where the values show it.
    """
    t = finite_stamps(key, array)
    kept = np.append(True, np.diff(t) != 0)
    repeated = int((~kept).sum())
    if repeated > max(1, MOST_REPEATED * len(t)):
        cause = lost_digits(t)
        if cause:
            raise InputError(
                f"{key}: {repeated} of {len(t)} stamps repeat the one before, so their digits are lost: {cause}"
            )
        raise InputError(
            f"{key}: {repeated} of {len(t)} stamps repeat the one before; write the time of each frame, with all digits"
        )
    _require_rising(key, t, np.flatnonzero(kept))
    t = t[kept]
    if len(t) < 2:
        raise InputError(f"{key}: both frames have the stamp {float(t[0])!r}; a recording needs two stamps")
    usual = float(np.median(np.diff(t)))
    if t[0] == 0.0 and t[1] > STRAY * usual:
        raise InputError(
            f"{key}: the stamp of frame 0 is 0, while the next is {float(t[1])!r} and the median interval {usual:.6g}: "
            "a value that was never set; write its time, or remove the frame"
        )
    return FrameStamps(t, np.asarray(kept, dtype=np.bool_), (*_repeats(key, np.flatnonzero(~kept)), *_rounding(key, t)))


def _require_rising(key: str, t: FloatArray, frame: IntArray) -> None:
    falls = np.flatnonzero(np.diff(t[frame]) < 0)
    if len(falls) == 0:
        return
    before, k = (int(i) for i in frame[falls[0] : falls[0] + 2])
    fault = f"frame {k} ({float(t[k])!r} s) is not after frame {before} ({float(t[before])!r} s)"
    advice = "sort the frames"
    if len(falls) == 1:
        advice = _stray(t, before, k) or advice
    raise InputError(f"{key}: stamps must rise, but {fault}; {advice}")


def _stray(t: FloatArray, before: int, k: int) -> str:
    """Advice where a single stamp is out of place: without it, or without the one before, the others rise."""
    for stray in (k, before):
        if (np.diff(np.delete(t, stray)) >= 0).all():
            return f"the stamp of frame {stray} alone is out of place: write its time, or remove the frame"
    return ""


def _repeats(key: str, frames: IntArray) -> list[Finding]:
    n = len(frames)
    if n == 0:
        return []
    which = ", ".join(str(k) for k in frames[:4].tolist()) + (f" and {n - 4} more" if n > 4 else "")
    many = f"{n} frames have the stamps of the frames" if n > 1 else "1 frame has the stamp of the frame"
    text = f"{key}: {many} before ({which}): of each such pair the first frame is kept."
    return [Finding("repeated_stamps", text, n, 0, "frames", "counted")]


def _rounding(key: str, t: FloatArray) -> list[Finding]:
    """Finding on stamps whose intervals scatter because the stamps were rounded or cut off."""
    dt = np.diff(t)
    usual = float(np.median(dt))
    beats = dt / dt.min()
    if np.abs(beats - np.round(beats)).max() < COARSE:
        return []  # a steady clock, with or without missing frames
    step, why = _step(t, usual)
    if step < COARSE * usual:
        return []
    text = (
        f"{key}: the stamps are multiples of {step:g}, {per_cent(step / usual)} of the median interval ({usual:g}){why}"
        ": every interval, and with it every motion, is wrong by up to as much."
    )
    return [Finding("stamps_rounded", text, step / usual, step / usual, "share of the interval", "counted")]


def _step(t: FloatArray, usual: float) -> tuple[float, str]:
    """The power of ten, or the step of a float32, of which all stamps are multiples; 0 for a fine one."""
    power = int(np.floor(np.log10(usual)))
    steps = [10.0**p for p in (power, power - 1, power - 2)]
    off = [float(np.abs(t / step - np.round(t / step)).max()) for step in steps]
    precision = float(np.spacing(np.abs(t).max()))
    decimal = next((step for step, o in zip(steps, off, strict=True) if o < 1e-6 + precision / step < COARSE), 0.0)
    if decimal == 0.0 and (t == t.astype(np.float32)).all():
        return float(np.spacing(np.float32(np.abs(t).max()))), ", the steps of a float32"
    return decimal, ""
