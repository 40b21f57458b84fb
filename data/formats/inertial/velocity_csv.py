"""Body velocities in a text file: stamp, linear velocity (m/s) and angular velocity (rad/s) in the IMU's frame."""

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ..files.file_errors import FilePath, reading, regular_file
from ..files.number_table import numbers_of, read_lines, require_width
from ..stamps.file_stamps import likely_seconds, stamps_of
from ..trajectories.checks import require_rising


def read_velocity_csv(path: FilePath, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Linear and angular velocity (T, 3) at the frames t (T,), s, interpolated between the lines.

    Raises InputError naming file and line, and where frames lie outside the lines by more than an interval.
    """
    with reading(path):
        lines = read_lines(regular_file(path))
        require_width(lines, {7: "a stamp, three linear and three angular velocities"})
        table = numbers_of(lines)
        stamps = stamps_of(lines.column(0), table.values[:, 0], None)
        require_rising(stamps, table.line)
        recorded = likely_seconds(stamps)
        slack = float(np.median(np.diff(recorded))) if len(recorded) > 1 else 0.0
        if recorded[0] - slack > t[0] or recorded[-1] + slack < t[-1]:
            raise InputError(
                f"its lines are from {float(recorded[0])!r} to {float(recorded[-1])!r} s and the frames from "
                f"{float(t[0])!r} to {float(t[-1])!r} s; give the velocities of this recording, on its clock"
            )
        at = np.stack([np.interp(t, recorded, column) for column in table.values[:, 1:].T], axis=1)
        return at[:, :3], at[:, 3:]
