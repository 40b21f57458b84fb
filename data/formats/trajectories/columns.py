"""Columns of a text trajectory (TUM, EuRoC, KITTI, CSV), identified by the names in its header or by their count."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from fgbaseline.geometry import InputError

from ...wording import plural
from ..files.number_table import Lines, split

Order = Literal["xyzw", "wxyz"]
"""order of a quaternion's components"""
XYZW_FIRST: tuple[Order, ...] = ("xyzw", "wxyz")
WXYZ_FIRST: tuple[Order, ...] = ("wxyz", "xyzw")

UNITS = {
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "msecs", "milliseconds"),
    "us": ("us", "usec", "usecs", "microsec", "microseconds"),
    "ns": ("ns", "nsec", "nsecs", "nanosec", "nanosecs", "nanosecond", "nanoseconds"),
}
TIME = ("stamp", "timestamp", "timestamps", "time", "times", "t")
"""names of time stamps, preferred ones first"""
METERS = {"mm": 1e-3, "cm": 1e-2, "km": 1e3}
"""units of positions other than m that a header may name"""
NUMBER = ("frame", "index", "idx", "id", "seq", "", "frame_id")
POSITION = {"p", "t", "pos", "position", "trans", "translation", "location", "point"}
QUATERNION = {"q", "o", "quat", "quaternion", "orientation", "rotation", "rot", "ori", "attitude"}
NO_POSITION = QUATERNION | {
    *("v", "vel", "velocity", "twist", "linear", "angular", "acc", "accel", "acceleration", "w", "omega", "gyro", "b"),
    *("bg", "ba", "bw", "bias", "std", "sigma", "cov", "covariance", "err", "error", "var", "a", "euler", "rpy", "g"),
}
VECTORS = {"timestamp": 1, "q": 4, "p": 3, "v": 3, "bg": 3, "ba": 3}
"""numbers of the vectors that a state file of OpenVINS names"""
OPENVINS = [f"p{part}{i}{k}" for part in "rt" for i in (1, 2, 3) for k in (1, 2, 3) if k >= i]
"""names of OpenVINS covariances: rotation, then translation, upper triangles"""


@dataclass(frozen=True, slots=True)
class Columns:
    """Column indices of a trajectory file, from 0."""

    position: tuple[int, ...] = ()
    quaternion: tuple[int, ...] = ()
    """columns in the order of `orders[0]`; empty for positions only"""
    orders: tuple[Order, ...] = ("xyzw",)
    """possible orders of the quaternion, the usual one first; one if a header names them"""
    matrix: tuple[int, ...] = ()
    """12 numbers of the upper three rows of a pose"""
    time: int | None = None
    nanoseconds: int | None = None
    """nanoseconds of stamps whose whole seconds are in `time`"""
    number: int | None = None
    """frame numbers, in place of stamps"""
    unit: str | None = None
    """unit of the stamps, if the header has it"""
    covariance: tuple[int, ...] = ()
    """12 of OpenVINS, or 36 as in ROS"""
    length: str = "m"
    """unit of the positions"""
    remark: str = ""
    """remark on the identification"""

    @property
    def stamp(self) -> int | None:
        """The time stamps, or the frame numbers in place of them."""
        return self.time if self.time is not None else self.number

    @property
    def indices(self) -> list[int]:
        """Indices of the columns to parse, in order: stamp, matrix, position, quaternion, covariance."""
        pose = [*self.matrix, *self.position, *self.quaternion, *self.covariance]
        return pose if self.stamp is None else [self.stamp, *pose]


def named_columns(lines: Lines) -> Columns | None:
    """Columns by the names in the header: the line above the data, or a comment there; None without such names.

    Raises InputError for a header that names no position or not each column.
    """
    for comment in reversed(lines.comments):
        names = names_of(comment, lines.separator)
        state = _of_state(names, lines.width)
        if state is not None:
            return state
        found = _by_name(names) if len(names) in (lines.width, lines.width - 1) else None
        if found is not None:
            return found if len(names) == lines.width else _behind_an_index(found)
    if lines.title is None:
        return None
    names = names_of(lines.title, lines.separator)
    found = _by_name(names)
    if found is None:
        raise InputError(f"its header {lines.title[:60]!r} names no position; call its columns t,x,y,z,qx,qy,qz,qw")
    if len(names) == lines.width:
        return found
    if len(names) == lines.width - 1:
        return _behind_an_index(found)
    raise InputError(
        f"line {lines.number[0]}: the header names {len(names)} columns, but there are {lines.width}; name each of them"
    )


def names_of(header: str, separator: str | None) -> list[str]:
    """Column names in a header."""
    header = header.strip().rstrip(",;")
    if separator is None and "," in header:
        separator = ","
    if separator is None and "\t" in header:
        separator = "\t"
    if separator is None:
        header = re.sub(r"\s+(?=[\[(])", "", header)
    return split(header, separator)


def _of_state(names: list[str], width: int) -> Columns | None:
    """Columns of a header that names whole vectors, as `timestamp(s) q p v bg ba` of OpenVINS; None for another."""
    places, place = {}, 0
    for name in (_plain(name) for name in names):
        if name not in VECTORS:
            break
        places[name] = tuple(range(place, place + VECTORS[name]))
        place += VECTORS[name]
    if not {"timestamp", "q", "p"} <= places.keys() or not len(names) < place <= width:
        return None
    # the numbers of JPL's rotation from the world to the body are those of Hamilton's from the body to the world
    return Columns(position=places["p"], quaternion=places["q"], time=places["timestamp"][0], unit="s")


def counted_columns(lines: Lines, *, whole: bool) -> Columns:
    """Columns by their count, without a header; `whole` is True for integer stamps.

    Raises InputError for a count of no known format.
    """
    width, comma = lines.width, lines.separator is not None
    if width in (16, 17) and lines.words(0)[-4:] and _is_last_row(lines.words(0)[-4:]):
        return _matrix(width - 16)
    if width in (12, 13):
        return _matrix(width - 12)
    pose = Columns(position=(1, 2, 3), quaternion=(4, 5, 6, 7), time=0, orders=XYZW_FIRST)
    if width == 4:
        return replace(pose, quaternion=(), orders=("xyzw",))
    if width == 8:
        return replace(pose, orders=WXYZ_FIRST if comma and whole else XYZW_FIRST)
    if width in (11, 17):
        return replace(pose, orders=WXYZ_FIRST)
    if width in (20, 44):
        return replace(pose, covariance=tuple(range(8, width)))
    if width == 9 and [lines.words(i)[0] for i in range(min(3, len(lines.text)))] in (["0", "1", "2"], ["1", "2", "3"]):
        return _behind_an_index(pose)
    raise InputError(
        f"line {lines.number[0]}: it has {plural(width, 'field')}, but without a header that names them a line has 8 "
        "numbers (TUM and EuRoC), 4 (positions), 12 or 13 (KITTI), 11 or 17 (with velocities behind), or 20 or 44 "
        "(with covariances)"
    )


def _matrix(first: int) -> Columns:
    """A pose's three rows behind `first` columns, which number the frames (or hold their stamps)."""
    return Columns(matrix=tuple(range(first, first + 12)), number=0 if first else None)


def _is_last_row(words: list[str]) -> bool:
    try:
        return [float(word) for word in words] == [0.0, 0.0, 0.0, 1.0]
    except ValueError:
        return False


def _behind_an_index(columns: Columns) -> Columns:
    """Columns one further to the right."""

    def moved(places: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(place + 1 for place in places)

    def one(place: int | None) -> int | None:
        return None if place is None else place + 1

    return replace(
        columns,
        position=moved(columns.position),
        quaternion=moved(columns.quaternion),
        covariance=moved(columns.covariance),
        time=one(columns.time),
        nanoseconds=one(columns.nanoseconds),
        number=one(columns.number),
    )


def _by_name(names: Sequence[str]) -> Columns | None:
    plain = [_plain(name) for name in names]
    groups: dict[tuple[str, ...], dict[str, int]] = {}
    for place, name in enumerate(plain):
        axis, prefix = _axis(name)
        if axis:
            groups.setdefault(prefix, {}).setdefault(axis, place)
    position = _position(groups)
    if position is None:
        return None
    quaternion, orders = _quaternion(groups)
    time, nanoseconds, unit = _time(names, plain)
    number = None
    if time is None:
        number = next((plain.index(name) for name in NUMBER if name in plain), None)
    turned = any({"roll", "pitch", "yaw"} & set(name.split("_")) for name in plain)
    return Columns(
        position=position,
        quaternion=quaternion,
        orders=orders,
        time=time,
        nanoseconds=nanoseconds,
        number=number,
        unit=unit,
        covariance=_covariance(plain) if quaternion else (),
        length=_length(names[position[0]]),
        remark="roll, pitch and yaw are not read: the header does not state their order" if turned else "",
    )


def _plain(name: str) -> str:
    """A name in small letters, its parts joined by `_`, without a unit in brackets."""
    name = re.sub(r"[\[(](\d)[\])]", r"_\1", name)
    name = re.sub(r"([a-z])([XYZW])$", r"\1_\2", re.sub(r"\s*[\[(][^\])]*[\])]", "", name))
    return "_".join(re.findall(r"[a-z0-9]+", re.sub(r"[_ ][kcm]?m$", "", name.strip().lower())))


def _length(name: str) -> str:
    """The unit of a position that stands in brackets or last in its name: m unless METERS has it."""
    found = re.search(r"[\[(_ ]\s*([kcm]m)\s*[\])]?$", name.strip().lower())
    return found[1] if found else "m"


def _axis(name: str) -> tuple[str, tuple[str, ...]]:
    """The axis that a name ends in, and the parts before it: of `p_rs_r_x` and `tx` x; none of `time`."""
    parts = name.split("_")
    last = parts[-1]
    if last in tuple("xyzw0123") and last:
        return last, tuple(parts[:-1])
    if len(last) == 2 and last[-1] in "xyzw0123" and last[0].isalpha():
        return last[-1], (*parts[:-1], last[0])
    return "", ()


def _position(groups: dict[tuple[str, ...], dict[str, int]]) -> tuple[int, ...] | None:
    for axes in ("xyz", "012"):
        for prefix, places in groups.items():
            if set(axes) <= places.keys() and _is_position(prefix):
                return tuple(places[axis] for axis in axes)
    return None


def _is_position(prefix: tuple[str, ...]) -> bool:
    """Whether the parts of a name before its axis are a position's: single letters behind the first name frames."""
    words = {part for i, part in enumerate(prefix) if i == 0 or len(part) > 1}
    return not prefix or (not NO_POSITION & words and bool(POSITION & words))


def _quaternion(groups: dict[tuple[str, ...], dict[str, int]]) -> tuple[tuple[int, ...], tuple[Order, ...]]:
    for prefix, places in groups.items():
        if QUATERNION & set(prefix) and set("xyzw") <= places.keys():  # in whatever order they stand
            return tuple(places[axis] for axis in "xyzw"), ("xyzw",)
    for prefix, places in groups.items():
        if QUATERNION & set(prefix) and set("0123") <= places.keys():
            return tuple(places[axis] for axis in "0123"), WXYZ_FIRST
    return (), ("xyzw",)


def _time(names: Sequence[str], plain: Sequence[str]) -> tuple[int | None, int | None, str | None]:
    """The places of the stamps and of their nanoseconds, and their unit where the name has it."""
    for place, name in enumerate(plain):
        head, _, last = name.rpartition("_")
        for rest, other in enumerate(plain):
            if last in UNITS["s"][1:] and other.rpartition("_")[::2] in [(head, word) for word in UNITS["ns"][1:]]:
                return place, rest, "ns"
    of_ros = any(name.startswith(("%time", "field.")) for name in names) or "%time" in names
    for wanted in TIME:
        for place, name in enumerate(plain):
            parts = name.split("_")
            unit = next((u for u, words in UNITS.items() if parts[-1] in words and len(parts) > 1), None)
            glued = re.fullmatch(r"(.*)(ns|us|ms)", parts[-1])
            if unit is None and glued and glued[1] == wanted:
                parts[-1], unit = glued[1], glued[2]
            if wanted in (parts[-1], *([parts[-2]] if unit and len(parts) > 1 else [])):
                bracket = re.search(r"[\[(]\s*([a-z]+)\s*[\])]", names[place].lower().replace("µ", "u"))
                written = next((u for u, words in UNITS.items() if bracket and bracket[1] in words), unit)
                ros = of_ros and names[place].startswith(("%time", "time", "field."))
                return place, None, written or ("ns" if ros else None)
    return None, None, None


def _covariance(plain: Sequence[str]) -> tuple[int, ...]:
    if set(OPENVINS) <= set(plain):
        return tuple(plain.index(name) for name in OPENVINS)
    found = {}
    for place, name in enumerate(plain):
        numbered = re.fullmatch(r"(?!.*twist)(.*cov(?:ariance)?)_?(\d+)", name)
        if numbered:
            found[int(numbered[2])] = place
    return tuple(found[k] for k in range(36)) if set(range(36)) <= found.keys() else ()
