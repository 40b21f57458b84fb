"""Parses text trajectories (TUM, EuRoC, KITTI, CSV); drops and counts lines without a pose and repeated stamps."""

from dataclasses import replace

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...observations import BoolArray, IntArray
from ..files.number_table import Lines
from ..stamps.file_stamps import equal_stamps, possible_units, stamps_of
from .checks import poses_of_matrices, require_rising, rotations_of_quaternions
from .columns import METERS, Columns
from .format_detection import TrajectoryText
from .parsed_trajectory import ParsedTrajectory
from .quaternion_order import xyzw

UP_OF_CAMERA = (0.0, -1.0, 0.0)
"""in the world of KITTI's poses: the left camera's frame 0, x right, y down, z forward"""
ROUNDING = 1e-12
"""deviation of a unit vector's length from 1"""
STEPS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""m, steps of positions that are rounded to decimal digits"""
MIN_STEPS = 1e4
"""number of steps in the largest position from which on digits may have been lost to it"""
COARSE = 2.0
"""factor on the mean motion from line to line above which a step is coarse"""
FORWARD = 0.9
"""cosine of the angle between motion and x axis of the body above which the body is no camera"""


def parse_text(text: TrajectoryText) -> ParsedTrajectory:
    """Trajectory of an opened text file. Raises InputError, without the name of the file."""
    lines, columns, values, numbers = text.lines, text.columns, text.table.values, text.table.line
    pose = values if columns.stamp is None else values[:, 1:]
    n_pose = len(columns.matrix) or len(columns.position) + len(columns.quaternion)
    stamp = None if columns.stamp is None else values[:, 0]
    kept, columns, remarks = _known(numbers, stamp, pose[:, :n_pose], columns)
    if columns.remark:
        remarks.append(columns.remark)
    line, pose = numbers[kept], pose[kept]
    up = _stated_up(lines)
    file = ParsedTrajectory(
        text.name, text.source, np.empty((0, 3)), None, line, up=up, up_stated=up is not None, remarks=tuple(remarks)
    )
    if stamp is not None:
        file, kept = _with_stamps(file, lines, columns, kept, stamp[kept], pose[:, :n_pose])
        pose, line = pose[kept], line[kept]
        file = replace(file, line=line)
    if columns.matrix:
        poses = poses_of_matrices(pose[:, :12], line)
        position, rotation = poses[:, :3, 3], poses[:, :3, :3]
        if file.up is None and file.stamps is None:  # KITTI's files have no stamps; others state no camera
            file = replace(file, up=_up_of_camera(position, rotation))
        return replace(file, position=position, rotation=rotation)
    if columns.length in METERS:
        pose = _in_meters(pose, METERS[columns.length], columns)
        file = replace(file, remarks=(*file.remarks, f"its positions are in {columns.length} and are given in m"))
    file = replace(file, position=pose[:, :3], remarks=(*file.remarks, *_rounding_remark(pose[:, :3])))
    if not columns.quaternion:
        return replace(file, remarks=(*file.remarks, "it has positions and no orientations"))
    quaternion = pose[:, 3:7]
    if not quaternion.any():
        return replace(file, remarks=(*file.remarks, "its quaternions are zero: it has positions and no orientations"))
    order = columns.orders[0]
    shown_order = " ".join(f"q{axis}" for axis in order)
    return replace(
        file,
        rotation=rotations_of_quaternions(
            xyzw(quaternion, order), line, f"{shown_order} of length 1 behind the position (here as x y z w)"
        ),
        quaternion=quaternion,
        orders=columns.orders,
        covariance_numbers=pose[:, 7:] if columns.covariance else None,
        remarks=(*file.remarks, *_covariance_remark(columns)),
    )


def _rounding_remark(position: FloatArray) -> tuple[str, ...]:
    """Remark on positions (n, 3), far from the origin, that were rounded (`%g`, float32) to steps above the motion."""
    for axis, x in zip("xyz", position.T, strict=True):
        largest = float(np.abs(x).max(initial=0.0))
        if largest < MIN_STEPS * STEPS[0] or float(np.ptp(x)) == 0.0:
            continue
        sizes = [size for size in (*STEPS, float(np.spacing(np.float32(largest)))) if MIN_STEPS * size <= largest]
        step = max((size for size in sizes if np.abs(x / size - np.round(x / size)).max() < 1e-6), default=0.0)
        moves = float(np.abs(np.diff(x)).mean())
        if step > COARSE * moves:
            return (
                f"its positions have lost digits: {axis}, up to {largest:.6g} m, is in steps of {step:.3g} m and moves "
                f"by {moves:.2g} m from line to line; write them in full, or less an origin",
            )
    return ()


def _in_meters(pose: FloatArray, unit: float, columns: Columns) -> FloatArray:
    """Positions and covariances (n, m), side by side, converted to m from lengths in multiples of `unit` m."""
    scale = np.ones(pose.shape[1])
    scale[:3] = unit
    if len(columns.covariance) == 12:
        scale[-6:] = unit**2
    elif columns.covariance:
        of_row = np.repeat([unit, 1.0], 3)
        scale[-36:] = np.outer(of_row, of_row).reshape(-1)
    return pose * scale


def _known(
    line: IntArray, stamp: FloatArray | None, pose: FloatArray, columns: Columns
) -> tuple[IntArray, Columns, list[str]]:
    """Indices (m,) of the lines (n,) that have a pose, the columns that these have, and remarks."""
    if columns.quaternion and np.isnan(pose[:, 3:7]).all() and np.isfinite(pose[:, :3]).any():
        remarks = ["its quaternions are NaN"]
        columns, pose = replace(columns, quaternion=(), covariance=()), pose[:, :3]
    else:
        remarks = []
    unknown: BoolArray = np.asarray(np.isnan(pose).any(axis=1))
    if stamp is not None:
        without_stamp = np.flatnonzero(~unknown & np.isnan(stamp))
        if len(without_stamp):
            raise InputError(f"line {line[without_stamp[0]]}: the time stamp is NaN; remove the line or mend it")
        unknown |= np.isnan(stamp)
    if unknown.all():
        raise InputError("every pose is NaN, so there is no trajectory; check that it is the right file")
    if unknown.any():
        count = int(unknown.sum())
        have = "has NaN in place of a pose and is" if count == 1 else "have NaN in place of a pose and are"
        remarks.append(f"{count:,} of {len(unknown):,} lines {have} left out")
    return np.flatnonzero(~unknown), columns, remarks


def _chosen(words: list[str], rows: IntArray) -> list[str]:
    return words if len(rows) == len(words) else [words[i] for i in rows.tolist()]


def _with_stamps(
    file: ParsedTrajectory, lines: Lines, columns: Columns, kept: IntArray, value: FloatArray, pose: FloatArray
) -> tuple[ParsedTrajectory, IntArray]:
    """File with stamps or frame numbers of the lines `kept`, and indices (m,) into `kept` without repeated stamps."""
    place = columns.time if columns.time is not None else columns.number
    assert place is not None
    words = _chosen(lines.column(place), kept)
    rest = None if columns.nanoseconds is None else _chosen(lines.column(columns.nanoseconds), kept)
    stamps = stamps_of(words, value, columns.unit, rest)
    moved: BoolArray = np.asarray((np.diff(pose, axis=0) != 0).any(axis=1))
    reason = equal_stamps(stamps, moved)
    if reason:
        raise InputError(reason)
    assert file.line is not None
    repeated = np.concatenate([[False], stamps.equal()])
    left = np.flatnonzero(~repeated)
    stamps, line = stamps.at(left), file.line[left]
    require_rising(stamps, line)
    remarks = file.remarks
    if repeated.any():
        count = int(repeated.sum())
        repeats = f"{count:,} of {len(repeated):,} lines {'repeats' if count == 1 else 'repeat'} the time stamp before"
        remarks = (*remarks, f"{repeats}; the first pose is kept")
    if columns.time is None and stamps.whole is not None and max(map(abs, stamps.whole)) < 10**7:
        return replace(file, frame=np.array(stamps.whole, dtype=np.int64), remarks=remarks), left
    if stamps.unit == "ns" and stamps.whole is None:
        i = int(np.flatnonzero(stamps.value != np.floor(stamps.value))[0])
        raise InputError(
            f"line {line[i]}: the time stamp {stamps.words[i]} is not a whole number of nanoseconds; write those"
        )
    units, is_known = possible_units(stamps)
    return replace(file, stamps=stamps, units=units, unit_known=is_known, remarks=remarks), left


def _covariance_remark(columns: Columns) -> tuple[str, ...]:
    if not columns.covariance:
        return ()
    if len(columns.covariance) == 12:
        return ("its covariances are read as OpenVINS writes them: rotation in the body, then position in the world",)
    return ("its covariances are read as in ROS: position, then rotation, both in the world",)


def _stated_up(lines: Lines) -> FloatArray | None:
    """Unit vector (3,) of a comment `# up x y z` above the data. Raises InputError where it is no direction."""
    for comment in lines.comments:
        word, *rest = comment.replace(",", " ").split()
        if word.rstrip(":=").lower() != "up" or len(rest) != 3:
            continue
        try:
            up = np.array(rest, dtype=np.float64)
        except ValueError:
            continue  # a comment in words, not a direction
        length = float(np.linalg.norm(up))
        if not (np.isfinite(length) and length > 0.0):
            raise InputError(f"its comment '# {comment}' gives no direction; write up as x y z, such as 0 0 1")
        return (
            up if abs(length - 1.0) < ROUNDING else np.asarray(up / length)
        )  # a unit vector is read back unchanged, to the bit
    return None


def _up_of_camera(position: FloatArray, rotation: FloatArray) -> FloatArray | None:
    """Up direction (3,) in the world of a camera; None for a body that moves along its x axis and is thus no camera."""
    steps = np.einsum("tji,tj->ti", rotation[:-1], np.diff(position, axis=0))
    length = np.linalg.norm(steps, axis=1)
    moving = np.asarray(length > 0.1 * np.max(length, initial=0.0))
    if np.any(moving) and np.median(np.abs(steps[moving, 0]) / length[moving]) > FORWARD:
        return None
    return np.array(UP_OF_CAMERA)
