"""Unit of time stamps, detected from their size and interval, and lost digits of repeated stamps.

Stamps counted from 1970 show their unit by their size; so does an interval between images of hours or years. Other
cases, such as slow keyframes, need the motion (`diagnosis.conventions.units`).

A float32 has seven significant digits, and a float64 holds whole numbers up to 2^53. Stamps of a long clock that were
stored in a narrower type, or printed with `%g`, repeat each other.
"""

from dataclasses import replace
from enum import StrEnum

import numpy as np

from fgbaseline.geometry import FloatArray

from .finding import Finding
from .sequence import Sequence
from .wording import plural


class TimeUnit(StrEnum):
    """Unit of a time stamp."""

    S = "s"
    MS = "ms"
    US = "us"
    NS = "ns"

    @property
    def per_second(self) -> int:
        """Units per second."""
        return {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[self.value]

    @property
    def seconds(self) -> float:
        """Length of the unit, s."""
        return 1.0 / self.per_second

    @property
    def noun(self) -> str:
        """Name in sentences."""
        return {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}[self.value]


EPOCH = (6e8, 4e9)
"""s since 1970: the years 1989 to 2096"""
USUAL_INTERVAL = (1e-3, 20.0)
"""s between frames, from 1000 frames a second to slow keyframes"""
LONGEST_INTERVAL = 3600.0
"""s, longest interval between frames that counts as one recording"""
EXACT_INTEGER = 2**53
"""a float64 holds every whole number up to here"""
SINGLE = 7
"""significant digits of a float32; `%g` and `std::cout` write one less"""
SAMPLE_PERIODS = (5e-5, 0.2)
"""s between raw inertial samples"""
COARSE = 0.02
"""rounding, as a share of the median interval, from which on intervals are noticeably wrong"""


def usual(interval: float) -> bool:
    """True if an interval in seconds is usual between two frames."""
    return USUAL_INTERVAL[0] <= interval <= USUAL_INTERVAL[1]


def since_1970(stamp: float, interval: float, slowest: float) -> TimeUnit | None:
    """The unit in which a stamp is a time since 1970, and stamps `interval` apart are at most `slowest` s apart."""
    for unit in TimeUnit:
        if EPOCH[0] <= stamp / unit.per_second < EPOCH[1] and interval / unit.per_second <= slowest:
            return unit
    return None


def unit_of_stamps(t: FloatArray) -> tuple[TimeUnit, str] | None:
    """Unit of stamps (T,) that cannot be seconds, and the evidence; None if they can be, or show no unit."""
    first, interval = float(t[0]), float(np.median(np.diff(t)))
    unit = since_1970(first, interval, LONGEST_INTERVAL)
    if unit is TimeUnit.S:
        return None
    if unit is not None and usual(interval * unit.seconds):
        year = np.datetime64(int(first * unit.seconds), "s").astype("datetime64[Y]")
        return unit, f"the first is {first:.6g}, which in {unit.noun} is a time of the year {year}"
    fitting = [unit for unit in TimeUnit if usual(interval * unit.seconds)]
    if interval > LONGEST_INTERVAL and len(fitting) == 1:
        return fitting[0], f"their median interval is {interval:.6g}, which only in {fitting[0].noun} is one of images"
    return None


def unit_of_samples(t: FloatArray, samples: FloatArray) -> tuple[TimeUnit, str] | None:
    """The unit of stamps of frames (T,) and of inertial samples (M,), and how they show it; None for seconds.

    None as well where no unit, or more than one, has usual intervals of both.
    """
    interval, period = float(np.median(np.diff(t))), float(np.median(np.diff(samples)))
    fitting = [
        unit
        for unit in TimeUnit
        if usual(interval * unit.seconds) and SAMPLE_PERIODS[0] <= period * unit.seconds <= SAMPLE_PERIODS[1]
    ]
    if TimeUnit.S in fitting or len(fitting) != 1:
        return None
    why = f"the median interval of the frames is {interval:.6g} and that of the inertial samples {period:.6g}"
    return fitting[0], f"{why}, which only in {fitting[0].noun} are those of images and of an IMU"


def lost_digits(t: FloatArray, longest: str | None = None) -> str:
    """Cause and remedy of equal stamps (T,) that should differ; empty if the values show none.

    `longest` is the stamp with the most digits as written in a text file.
    """
    largest = float(np.abs(t).max())
    if longest is not None and significant_digits(longest) <= SINGLE:
        return (
            f"{longest} has {plural(significant_digits(longest), 'significant figure')}; write them in full "
            "(C++: std::fixed and std::setprecision(9))"
        )
    if (t == t.astype(np.float32)).all():
        step = float(np.spacing(np.float32(largest)))
        if step > COARSE * abs(float(t[-1] - t[0])) / (len(t) - 1):
            return (
                f"they went through a float32, which has steps of {step:g} at {largest:g}; write them as float64 from "
                "the source"
            )
    if largest > EXACT_INTEGER and (t == np.round(t)).all():
        return (
            f"they are whole numbers beyond 2^53, which a float64 holds in steps of {float(np.spacing(largest)):g}; "
            "subtract the first one as integers, or write seconds"
        )
    if longest is not None:
        return ""
    digits = SINGLE - 1
    if all(value == float(f"{value:.{digits}g}") for value in t.tolist()) and largest >= 10.0**digits:
        return f"they have {digits} significant figures, as %g writes; write all digits"
    if (t == np.round(t)).all():
        return "they are whole numbers, cut off or rounded; write the fraction of a second as well"
    return ""


def significant_digits(word: str) -> int:
    """The significant figures of a number as written."""
    mantissa = word.lower().partition("e")[0].lstrip("+-").replace(".", "")
    return len(mantissa.lstrip("0"))


def in_seconds(sequence: Sequence, unit: TimeUnit | None = None) -> Sequence:
    """Recording with its stamps in seconds, and a remark on the conversion.

    `unit` is given by the user; without it, it is detected from the stamps alone.
    """
    if unit is not None:
        remark = f"The time stamps are in {unit.noun}, as given."
        scaled = rescaled_time(sequence, unit.seconds)
        return replace(scaled, remarks=(*sequence.remarks, remark), time_unit_given=True)
    found = unit_of_stamps(sequence.t)
    if found is None and sequence.imu is not None and not sequence.time_unit_given:
        found = unit_of_samples(sequence.t, sequence.imu.t)
    if found is None:
        return sequence
    unit, why = found
    text = f"The time stamps are in {unit.noun} ({why}): they are multiplied by {unit.seconds:g}."
    finding = Finding("time_unit", text, 1.0 / unit.seconds, 1.0, "stamps a second", "certain from the stamps alone")
    return replace(rescaled_time(sequence, unit.seconds), findings=(*sequence.findings, finding))


def rescaled_time(sequence: Sequence, factor: float) -> Sequence:
    """The recording with its stamps multiplied, those of raw inertial samples too."""
    if factor == 1.0:
        return sequence
    imu = None if sequence.imu is None else replace(sequence.imu, t=sequence.imu.t * factor)
    return replace(sequence, t=sequence.t * factor, imu=imu)
