"""The unit of time stamps, and that of a recording's: as it is given, or as the stamps alone show it.

A clock that counts from 1970 shows its unit by its size. So does an interval between two images of hours or years.
Anything else, as slow keyframes, takes a look at the motion (`diagnose.units`).
"""

from dataclasses import replace
from enum import StrEnum

import numpy as np

from fgbaseline.geometry import FloatArray

from .finding import Finding
from .sequence import Sequence


class TimeUnit(StrEnum):
    """What a time stamp counts."""

    S = "s"
    MS = "ms"
    US = "us"
    NS = "ns"

    @property
    def per_second(self) -> int:
        """How many there are in a second."""
        return {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[self.value]

    @property
    def seconds(self) -> float:
        """How long one is."""
        return 1.0 / self.per_second

    @property
    def noun(self) -> str:
        """Its name in sentences."""
        return {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}[self.value]


EPOCH = (9e8, 2.6e9)
"""s since 1970: the years 1998 to 2052"""
USUAL_INTERVAL = (1e-3, 20.0)
"""s between frames, from 1000 frames a second to slow keyframes"""
LONGEST_INTERVAL = 3600.0
"""s between frames of one recording, however slow its keyframes are"""


def usual(interval: float) -> bool:
    """Whether so many seconds are usual between two frames."""
    return USUAL_INTERVAL[0] <= interval <= USUAL_INTERVAL[1]


def unit_of_stamps(t: FloatArray) -> tuple[TimeUnit, str] | None:
    """The unit of stamps (T,) that can be no seconds, and how they show it; None where they can, or say nothing."""
    first, interval = float(t[0]), float(np.median(np.diff(t)))
    if EPOCH[0] <= first <= EPOCH[1] and interval <= LONGEST_INTERVAL:
        return None
    for unit in (TimeUnit.MS, TimeUnit.US, TimeUnit.NS):
        if EPOCH[0] <= first * unit.seconds <= EPOCH[1] and usual(interval * unit.seconds):
            year = np.datetime64(int(first * unit.seconds), "s").astype("datetime64[Y]")
            return unit, f"the first is {first:.6g}, which in {unit.noun} is a time of the year {year}"
    fitting = [unit for unit in TimeUnit if usual(interval * unit.seconds)]
    if interval > LONGEST_INTERVAL and len(fitting) == 1:
        return fitting[0], f"their median interval is {interval:.6g}, which only in {fitting[0].noun} is one of images"
    return None


def in_seconds(sequence: Sequence, unit: TimeUnit | None = None) -> Sequence:
    """The recording with its stamps in seconds, and what was done about them.

    `unit` is what the user knows of them; without it the unit that the stamps alone show.
    """
    if unit is not None:
        said = f"The time stamps are in {unit.noun}, as given."
        scaled = rescaled_time(sequence, unit.seconds)
        return replace(scaled, remarks=(*sequence.remarks, said), time_unit_given=True)
    found = unit_of_stamps(sequence.t)
    if found is None:
        return sequence
    unit, why = found
    text = f"The time stamps are in {unit.noun} ({why}): they are multiplied by {unit.seconds:g}."
    finding = Finding("time_unit", text, 1.0 / unit.seconds, 1.0, "stamps a second", "certain from the stamps alone")
    return replace(rescaled_time(sequence, unit.seconds), findings=(*sequence.findings, finding))


def rescaled_time(sequence: Sequence, factor: float) -> Sequence:
    """The recording with its stamps multiplied."""
    return sequence if factor == 1.0 else replace(sequence, t=sequence.t * factor)
