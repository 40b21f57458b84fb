"""EuRoC trajectories: CSV with stamps in nanoseconds, position, quaternion w x y z, and whatever else the line holds.

`state_groundtruth_estimate0/data.csv` has 17 numbers a line (velocity and biases behind the pose), `vicon0/data.csv`
and what `write_euroc` leaves have 8.
"""

from itertools import pairwise

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from .beside import written_beside
from .named_file import FilePath, reading, regular_file
from .number_table import Lines, numbers_of, read_lines
from .stamped_poses import poses_of_quaternions, require_rising, writable

COUNTS = {8: "EuRoC poses", 17: "EuRoC states"}
HEADER = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
NANOSECONDS = 10**9


def read_euroc(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s, strictly rising, and poses (n, 4, 4) `world_T_body` of a EuRoC CSV.

    Raises InputError naming file and line as `read_tum` does, and for stamps that are no whole nanoseconds.
    """
    with reading(path), np.errstate(all="ignore"):
        return euroc_poses(read_lines(regular_file(path)))


def euroc_poses(lines: Lines) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,) and poses (n, 4, 4) of the lines of a EuRoC CSV. Raises InputError naming the line."""
    table = numbers_of(lines, COUNTS, ",")
    t = np.array([_seconds(text, number) for number, text in zip(lines.number, lines.text, strict=True)])
    xyzw = np.roll(table.values[:, 4:8], -1, axis=1)
    poses = poses_of_quaternions(
        table.values[:, 1:4], xyzw, table.line, "qw qx qy qz of length 1 behind the position (here as x y z w)"
    )
    require_rising(t, table.line)
    return t, poses


def write_euroc(path: FilePath, t: FloatArray, world_T_body: FloatArray) -> None:
    """Writes stamps (n,), s, rounded to nanoseconds, and poses (n, 4, 4) as a EuRoC CSV; all-NaN poses are left out.

    `read_euroc` gives back stamps that are whole nanoseconds and positions bit by bit, rotations to 1e-14. Raises
    InputError when a stamp is negative, rounded stamps do not rise, a pose is no rigid motion, or the file cannot be
    written.
    """
    stamps, poses = writable(t, world_T_body)
    nanoseconds = [_nanoseconds(stamp) for stamp in stamps.tolist()]
    for before, after in pairwise(nanoseconds):
        if after <= before:
            raise InputError(f"two stamps are the same nanosecond ({after}), which EuRoC files cannot tell apart")
    wxyz = np.roll(so3.quaternion_xyzw(poses[:, :3, :3]), 1, axis=1)
    rows = np.concatenate([poses[:, :3, 3], wxyz], axis=1).tolist()
    lines = [",".join([str(ns), *map(repr, row)]) for ns, row in zip(nanoseconds, rows, strict=True)]
    with written_beside(path) as file:
        file.write("\n".join([HEADER, *lines, ""]).encode("ascii"))


def _seconds(text: str, number: int) -> float:
    """Of the first word of a line, in nanoseconds: whole ones are divided exactly, as doubles cannot hold them."""
    word = text.partition(",")[0].strip()
    if word.isdigit():
        return int(word) / NANOSECONDS
    value = float(word)
    if value < 0 or not value.is_integer():
        raise InputError(
            f"line {number}: the time stamp {word} is no whole number of nanoseconds; EuRoC files count them"
        )
    return int(value) / NANOSECONDS


def _nanoseconds(t: float) -> int:
    """The nearest whole nanosecond to t, s."""
    numerator, denominator = t.as_integer_ratio()
    if numerator < 0:
        raise InputError(f"the time stamp {t!r} s is negative, which EuRoC files do not have")
    return (2 * NANOSECONDS * numerator + denominator) // (2 * denominator)
