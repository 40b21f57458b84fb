"""Truth of a recording with raw inertial samples: in the axes of its file, from the first frame that has a pose."""

from dataclasses import replace

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...observations import IntArray
from ...sequence import Truth
from ..files.bag_file import split_topic
from ..files.file_errors import FilePath, regular_file
from ..files.number_table import numbers_of, read_lines

STATE_WIDTH = 17
"""columns of EuRoC's truth: stamp, position, quaternion, velocity, gyroscope and accelerometer bias"""


def inertial_truth(poses: FloatArray, source: str) -> Truth:
    """Truth of poses (T, 4, 4) in any world, whose origin is moved to the first known one; its axes are kept.

    A problem ties it to its own world, over the frames that have a pose. Raises InputError where none has.
    """
    world_T_imu = poses.copy()
    known = np.isfinite(poses).all(axis=(1, 2))
    if not known.any():
        raise InputError(f"the ground truth ({source}) has no pose for any frame")
    world_T_imu[:, :3, 3] -= poses[int(np.argmax(known)), :3, 3]
    world_T_imu[~known] = np.nan
    return Truth(world_T_imu, source=source)


def with_state(truth: Truth, path: FilePath, line: IntArray) -> Truth:
    """The truth with velocity and biases, where the file has EuRoC's 17 columns; `line` (T,) is that of each frame.

    The axes of the world are those of the file, whose z axis points up. Raises InputError naming the line for what is
    no number.
    """
    if split_topic(path) is not None:
        return truth
    file = regular_file(path)
    with file.open("rb") as opened:
        if opened.read(2) == b"PK":
            return truth
    lines = read_lines(file)
    if lines.width != STATE_WIDTH or lines.separator is None:
        return truth
    table = numbers_of(lines, range(8, STATE_WIDTH), nan=True)
    state = np.full((len(line), STATE_WIDTH - 8), np.nan)
    known = line >= 0
    state[known] = table.values[np.searchsorted(table.line, line[known])]
    up = np.array([0.0, 0.0, 1.0])  # an accelerometer's bias is known beside gravity only: such a world has z up
    return replace(truth, velocity=state[:, :3], gyroscope_bias=state[:, 3:6], accelerometer_bias=state[:, 6:], up=up)
