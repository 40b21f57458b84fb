"""EuRoC trajectories are read and written: CSV of stamps (ns), positions (m) and quaternions w x y z."""

from itertools import pairwise

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from ..files.atomic_write import atomic_write
from ..files.file_errors import FilePath
from .checks import writable
from .reader import read_trajectory

HEADER = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
NANOSECONDS = 10**9


def read_euroc(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s, strictly rising, and poses (n, 4, 4) `world_T_body` of a EuRoC CSV.

    Raises as `read_trajectory`, and for stamps that are no whole nanoseconds.
    """
    read = read_trajectory(path, "euroc")
    return read.t, read.world_T_body


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
            raise InputError(f"two stamps are the same nanosecond ({after}), which EuRoC files cannot distinguish")
    wxyz = np.roll(so3.quaternion_xyzw(poses[:, :3, :3]), 1, axis=1)
    rows = np.concatenate([poses[:, :3, 3], wxyz], axis=1).tolist()
    lines = [",".join([str(ns), *map(repr, row)]) for ns, row in zip(nanoseconds, rows, strict=True)]
    with atomic_write(path) as file:
        file.write("\n".join([HEADER, *lines, ""]).encode("ascii"))


def _nanoseconds(t: float) -> int:
    """The nearest whole nanosecond to t, s."""
    numerator, denominator = t.as_integer_ratio()
    if numerator < 0:
        raise InputError(f"the time stamp {t!r} s is negative, which EuRoC files do not have")
    return (2 * NANOSECONDS * numerator + denominator) // (2 * denominator)
