"""Reads trajectories: TUM, EuRoC, KITTI and other CSV, npz, and topics of bags.

The format is detected from the content, never from the file name: `format_detection` opens a file,
`columns` recognizes its columns, and `text_parser` parses its lines.
"""

from dataclasses import replace

import numpy as np

from fgbaseline.geometry import FloatArray

from ...time_unit import TimeUnit
from ...trajectory import Trajectory
from ..files.file_errors import FilePath, reading
from ..stamps.file_stamps import possible_units, stamps_of
from .bag_topic import read_bag_trajectory
from .columns import Order
from .format_detection import (
    OpenedTrajectory,
    TrajectoryArchive,
    TrajectoryFormat,
    TrajectoryText,
    TrajectoryTopic,
    open_trajectory,
)
from .npz import read_trajectory_npz
from .parsed_trajectory import ParsedTrajectory, unit_and_order
from .text_parser import parse_text


def read_trajectory(
    path: FilePath,
    form: TrajectoryFormat | None = None,
    times: FloatArray | None = None,
    name: str | None = None,
    *,
    time_unit: TimeUnit | None = None,
    quaternion: Order | None = None,
) -> Trajectory:
    """Trajectory of a TUM, KITTI, EuRoC or npz file, or another CSV, called `name` (the file's stem by default).

    The format is detected from the content; `form` requires one. KITTI files have no time stamps: line k is taken at
    `times[k]`, s (see `read_times`); without times it is frame k, and the trajectory is not `stamped`. Files of other
    formats have stamps, and `times` is ignored. `time_unit` and `quaternion` decide what the file leaves open. Raises
    InputError naming file and line (or pose) for a wrong count, fields that are no numbers, stamps that are not sorted
    or lost digits, and poses that are no rigid motion.
    """
    file = read_trajectory_file(path, form, name)
    return file.trajectory(
        *unit_and_order(file, time_unit, quaternion), () if times is None else (times[: max(len(file.position), 1)],)
    )


def read_pose_covariances(path: FilePath) -> FloatArray | None:
    """Covariances (n, 6, 6) of the poses of a trajectory file; None for files without covariances.

    They are those of the right perturbation [v, w], m and rad, one for each pose that `read_trajectory` returns.
    """
    return read_trajectory_file(path).covariance()


def read_trajectory_file(
    path: FilePath, form: TrajectoryFormat | None = None, name: str | None = None
) -> ParsedTrajectory:
    """Parsed file, or topic of a bag (`run.bag:/odom`), with what it leaves open. Raises as `read_trajectory`."""
    return parsed_file(open_trajectory(path, form, name))


def parsed_file(opened: OpenedTrajectory) -> ParsedTrajectory:
    """Parsed trajectory of an opened file or topic of a bag. Raises as `read_trajectory`."""
    if isinstance(opened, TrajectoryTopic):
        return read_bag_trajectory(opened.bag, opened.topic, opened.name)
    with reading(opened.source), np.errstate(all="ignore"):
        if not isinstance(opened, TrajectoryText):
            return _of_npz(opened)
        read, lines = parse_text(opened), opened.lines
        if opened.has_header or len(read.orders) == 1 or (lines.separator is None and lines.width in (8, 9, 20, 44)):
            return read
        order = " ".join(read.orders[0])
        return replace(read, remarks=(*read.remarks, f"no header names the order of its quaternions; {order} is usual"))


def _of_npz(file: TrajectoryArchive) -> ParsedTrajectory:
    t, poses, covariance, remarks = read_trajectory_npz(file.file)
    stamps = stamps_of([repr(stamp) for stamp in t.tolist()], t, None)
    units, is_known = possible_units(stamps)
    return ParsedTrajectory(
        name=file.name,
        source=file.source,
        position=poses[:, :3, 3],
        rotation=poses[:, :3, :3],
        stamps=stamps,
        units=units,
        unit_known=is_known,
        covariance_numbers=covariance,
        remarks=tuple(remarks),
    )
