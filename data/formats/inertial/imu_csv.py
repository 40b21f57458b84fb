"""Raw inertial samples in a CSV as EuRoC has it: `timestamp [ns]`, three angular velocities, three specific forces."""

import re

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...imu import ImuNoise
from ...time_unit import TimeUnit
from ..files.file_errors import FilePath, reading, regular_file
from ..files.number_table import Lines, numbers_of, read_lines
from ..stamps.file_stamps import Stamps, likely_seconds, stamps_of
from ..trajectories.columns import names_of
from .imu_samples import RawSamples, imu_samples

GYROSCOPE = re.compile(r"(w_rs_s|gyro\w*|gyr|angular_?velocity|angular_?rate|omega|w|g|rot\w*)[._]?([xyz])")
ACCELEROMETER = re.compile(r"(a_rs_s|accel\w*|acc|linear_?acceleration|specific_?force|a|f)[._]?([xyz])")
TIME = (re.compile(r"header\.stamp"), re.compile(r"[#%]?\s*(time\w*|t|stamp\w*)"))
"""names of the time stamp, the preferred one first: in exports of ROS `%time` is when a message was recorded"""
UNIT = re.compile(r"[\[(]([^\])]*)[\])]")
EUROC = tuple(range(7))
"""places of stamp, angular velocity and specific force where no header names them"""
FACTORS = dict.fromkeys(("deg", "degree", "degrees", "dps", "°"), np.pi / 180.0) | {"g": 9.80665, "mg": 9.80665e-3}
"""factors of the units that a header may name, by their first word"""


def read_imu_csv(path: FilePath, noise: ImuNoise, gravity: float) -> RawSamples:
    """The samples in a CSV file, by its header; without one it has EuRoC's seven columns, the stamps in ns.

    Raises InputError naming file and line for what is no number, and where a column is missing.
    """
    with reading(path), np.errstate(all="ignore"):
        lines = read_lines(regular_file(path))
        lines.require_some("samples")
        names = _names(lines)
        places = EUROC if names is None else _places(names)
        if lines.width < len(EUROC):
            raise InputError(
                f"line {lines.number[0]}: expected a stamp, three angular velocities and three specific forces, got "
                f"{lines.width} numbers"
            )
        values = numbers_of(lines, places).values
        units = ["" if names is None else _unit(names[place]) for place in places]
        factors = [FACTORS.get(unit.split(" ")[0].split("/")[0].lower(), 1.0) for unit in units]
        values[:, 1:] *= factors[1:]
        t = _seconds(stamps_of(lines.column(places[0]), values[:, 0], units[0] or None), named=names is not None)
        samples, findings = imu_samples(t, values[:, 1:4], values[:, 4:7], noise, gravity)
        named = sorted({unit for unit, factor in zip(units, factors, strict=True) if factor != 1.0})
        remarks = [f"The header has values in {' and '.join(named)}: converted to rad/s and m/s^2."] if named else []
        return RawSamples(samples, tuple(remarks), findings)


def _names(lines: Lines) -> list[str] | None:
    """The names of the columns in the comment or line above the data; None where there is none."""
    for header in (*reversed(lines.comments), *([lines.title] if lines.title else [])):
        names = names_of(header, lines.separator)
        if len(names) == lines.width and any(GYROSCOPE.fullmatch(_bare(name)) for name in names):
            return names
    if lines.title is not None:
        raise InputError(f"its header {lines.title[:60]!r} names no angular velocity; call its columns as EuRoC does")
    return None


def _bare(name: str) -> str:
    """A name in lower case, without its unit and what stands before the last two parts of a path."""
    parts = UNIT.sub("", name).strip().lower().split(".")
    return ".".join(parts[-2:])


def _unit(name: str) -> str:
    found = UNIT.search(name)
    return found.group(1).strip() if found else ""


def _places(names: list[str]) -> tuple[int, ...]:
    bare = [_bare(name) for name in names]
    places = [next((i for time in TIME for i, name in enumerate(bare) if time.fullmatch(name)), -1)]
    for sensor in (GYROSCOPE, ACCELEROMETER):
        found = {match.group(2): i for i, name in enumerate(bare) if (match := sensor.fullmatch(name))}
        places += [found.get(axis, -1) for axis in "xyz"]
    if -1 in places:
        vectors = (f"{kind} {axis}" for kind in ("angular velocity", "acceleration") for axis in "xyz")
        wanted = ("time stamp", *vectors)
        raise InputError(f"its header names no {wanted[places.index(-1)]}; call its columns as EuRoC does")
    return tuple(places)


def _seconds(stamps: Stamps, *, named: bool) -> FloatArray:
    """The stamps in s; whole ones without a unit are nanoseconds, as EuRoC writes them."""
    if not named and stamps.whole is not None:
        return stamps.seconds(TimeUnit.NS)
    return likely_seconds(stamps)
