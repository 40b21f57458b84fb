"""Time stamps of a trajectory file: exact values and possible units."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...observations import BoolArray, IntArray
from ...time_unit import SAMPLE_PERIODS, TimeUnit, lost_digits, significant_digits, since_1970
from ...wording import plural

FASTEST, USUAL, SLOWEST = 5e-4, 20.0, 1e4
"""s between two poses: of no recorder, of a recorder, of keyframes at most"""
CERTAIN_BELOW = 5.0
"""s between two poses: stamps that are nearer in seconds are taken to be seconds"""
EPOCH_INTERVAL = 1e3
"""s between two poses at most, where the size of stamps alone shows that they count from 1970"""
REPEATED = 0.1
"""share of repeated stamps between poses that differ, above which the stamps have lost digits"""
SYMBOL = 56
"""bits of a GTSAM key below its letter"""


@dataclass(frozen=True, eq=False, slots=True)
class Stamps:
    """n time stamps as the file has them."""

    value: FloatArray
    """(n,)"""
    whole: tuple[int, ...] | None
    """exact values, where all of them are whole numbers"""
    unit: TimeUnit | None
    """unit of the stamps, if the header has it"""
    words: Sequence[str] = ()
    """(n,) as written"""

    def at(self, index: IntArray) -> "Stamps":
        """The stamps of these rising indices (m,)."""
        if len(index) == len(self.value):
            return self
        whole = None if self.whole is None else tuple(self.whole[i] for i in index.tolist())
        return Stamps(self.value[index], whole, self.unit, [self.words[i] for i in index.tolist()])

    def seconds(self, unit: TimeUnit) -> FloatArray:
        """Stamps (n,), s; integers are divided exactly, as doubles cannot hold nanoseconds since 1970."""
        per_second = unit.per_second
        if per_second == 1:
            return self.value.copy()
        if self.whole is not None:
            return np.array([stamp / per_second for stamp in self.whole])
        return self.value / per_second

    @property
    def interval(self) -> float | None:
        """The median from one stamp to the next, in their unit; None with less than two."""
        steps = np.diff(self.value)
        steps = steps[steps > 0]
        return float(np.median(steps)) if len(steps) else None

    def rising(self) -> BoolArray:
        """Mask (n - 1,): whether each stamp is after the previous one."""
        if self.whole is None:
            return np.asarray(np.diff(self.value) > 0)
        return np.array([b > a for a, b in zip(self.whole[:-1], self.whole[1:], strict=True)], dtype=np.bool_)

    def equal(self) -> BoolArray:
        """Mask (n - 1,): whether each stamp is equal to the previous one."""
        if self.whole is None:
            return np.asarray(np.diff(self.value) == 0)
        return np.array([b == a for a, b in zip(self.whole[:-1], self.whole[1:], strict=True)], dtype=np.bool_)


def stamps_of(words: Sequence[str], value: FloatArray, unit: str | None, rest: Sequence[str] | None = None) -> Stamps:
    """The stamps written as `words` (n,), which are the numbers `value` (n,); `rest`: whole nanoseconds behind."""
    whole: tuple[int, ...] | None = None
    if rest is not None:
        try:
            whole = tuple(int(a) * 10**9 + int(b) for a, b in zip(words, rest, strict=True))
            value = np.array([float(stamp) for stamp in whole])
        except (ValueError, OverflowError) as error:
            raise InputError("the seconds and nanoseconds of its stamps are not whole numbers; write those") from error
    elif (value == np.floor(value)).all():
        whole = tuple(_exactly(word, number) for word, number in zip(words, value.tolist(), strict=True))
    known = next((u for u in TimeUnit if u == unit), None)
    return Stamps(value, whole, known, words)


def likely_seconds(stamps: Stamps) -> FloatArray:
    """The stamps of velocities or inertial samples in s, in the likeliest of their `possible_units`; a single one is in
    s.

    Raises InputError where none of the units fits.
    """
    if len(stamps.value) < 2:
        return stamps.seconds(TimeUnit.S)
    units, _ = possible_units(stamps, SAMPLE_PERIODS[0])
    if not units:
        raise InputError(f"{no_unit(stamps)}; write seconds")
    return stamps.seconds(units[0])


def no_unit(stamps: Stamps) -> str:
    """Why none of the units fits, in words."""
    return (
        f"its time stamps are {stamps.interval:.3g} apart, which is not an interval of a recorder in seconds, "
        "milliseconds, microseconds or nanoseconds"
    )


def possible_units(stamps: Stamps, fastest: float = FASTEST) -> tuple[tuple[TimeUnit, ...], bool]:
    """Possible units of the stamps, likeliest first, and True if header or size determine the unit.

    Seconds since 1970 have their size in each unit; otherwise the interval between stamps decides. Empty if no unit
    gives a recorder's interval, at least `fastest` s; both units if header and size contradict each other.
    """
    interval = stamps.interval
    by_size = since_1970(float(np.median(np.abs(stamps.value))), interval or 0.0, EPOCH_INTERVAL)
    if stamps.unit is not None:
        if by_size not in (None, stamps.unit):
            return (stamps.unit, by_size), False
        return (stamps.unit,), True
    if by_size is not None:
        return (by_size,), True
    if interval is None or (fastest <= interval < CERTAIN_BELOW):
        return (TimeUnit.S,), False
    units = [TimeUnit.S] if interval <= SLOWEST and interval >= fastest else []
    units += [u for u in TimeUnit if u is not TimeUnit.S and fastest <= interval / u.per_second <= USUAL]
    return tuple(units), False


def equal_stamps(stamps: Stamps, moved: BoolArray) -> str | None:
    """Cause of many equal stamps between poses that `moved` (n - 1,): lost digits, or GTSAM keys in place of stamps.

    None otherwise.
    """
    n = len(stamps.value)
    letter = _letter(stamps)
    if letter:
        return (
            f"its first column has GTSAM keys ({letter}0 is {ord(letter) << SYMBOL}), integers beyond 2^53, and no "
            "time stamps; write the time of each pose"
        )
    repeats = int((stamps.equal() & moved).sum())
    if repeats == 0 or repeats <= REPEATED * (n - 1):
        return None
    share = f"{n} poses share {plural(n - repeats, 'time stamp')}"
    cause = lost_digits(stamps.value, max(stamps.words, key=significant_digits, default="")) or "write them in full"
    return f"its time stamps have lost digits: {share}: {cause}"


def _letter(stamps: Stamps) -> str:
    """The letter of GTSAM's keys, if all the stamps are such."""
    if stamps.whole is None or not stamps.whole or min(stamps.whole) < ord("A") << SYMBOL:
        return ""
    letters = {stamp >> SYMBOL for stamp in stamps.whole}
    index = stamps.whole[-1] & ((1 << SYMBOL) - 1)
    letter = chr(min(letters)) if len(letters) == 1 and max(letters) < 128 else ""
    return letter if letter.isalpha() and index < 2**40 else ""


def _exactly(word: str, number: float) -> int:
    head, _, tail = word.partition(".")
    plain = head.lstrip("+-").isdecimal() and len(head) < 400 and not tail.strip("0")
    return int(head) if plain else int(number)
