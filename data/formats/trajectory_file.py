"""`read_trajectory`: a trajectory in any of the known formats, detected from its content and never from its name."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, so3

from ..observations import BoolArray, IntArray
from ..time_unit import TimeUnit
from ..trajectory import Trajectory
from .columns import Columns, Order, counted_columns, named_columns
from .kitti import kitti_poses
from .named_file import FilePath, reading, regular_file, shown
from .number_table import Lines, NumberTable, numbers_of, read_lines
from .pose_covariances import pose_covariances
from .stamped_poses import require_rising, rotations_of_quaternions
from .stamps import Stamps, lost_digits, possible_units, stamps_of
from .trajectory_npz import read_trajectory_npz

TrajectoryFormat = Literal["tum", "kitti", "euroc", "npz"]
ZIP = (b"PK\x03\x04", b"PK\x05\x06")
UP_OF_CAMERA = (0.0, -1.0, 0.0)
"""in the world of KITTI's poses: the left camera's frame 0, x right, y down, z forward"""
STRAIGHT = 1e-3
FORWARD = 0.9
"""the cosine of the angle to the body's x axis: a body that travels so is no camera"""


@dataclass(frozen=True, eq=False, slots=True)
class TrajectoryFile:
    """What a trajectory file holds, and what it leaves open: n poses."""

    name: str
    source: str
    """the file it came from"""
    position: FloatArray
    """(n, 3) m"""
    rotation: FloatArray | None
    """(n, 3, 3) `world_R_body`, quaternions read in the first of `orders`; None where there are positions only"""
    line: IntArray | None = None
    """(n,) the line that each pose stands on"""
    quaternion: FloatArray | None = None
    """(n, 4) the four numbers as they stand in the file"""
    orders: tuple[Order, ...] = ("xyzw",)
    """the orders that they may have, the usual one first; one where the file states it"""
    stamps: Stamps | None = None
    """None where the file has none"""
    units: tuple[TimeUnit, ...] = (TimeUnit.S,)
    """that the stamps may have, the likeliest first; none where no unit makes their rate a recorder's"""
    unit_settled: bool = True
    """whether header or size of the stamps show their unit"""
    frame: IntArray | None = None
    """(n,) the number of each pose's frame, where there are no stamps but numbers"""
    covariance_numbers: FloatArray | None = None
    """(n, 12), (n, 36) as written in text, or (n, 6, 6) of the right perturbation"""
    up: FloatArray | None = None
    """(3,) what points up in its world, where the format defines it"""
    remarks: tuple[str, ...] = ()
    """what was recognized: each completes a sentence that begins with the file's name"""

    def trajectory(
        self,
        unit: TimeUnit | None = None,
        order: Order | None = None,
        times: Sequence[FloatArray] = (),
        *,
        oriented: bool = True,
    ) -> Trajectory:
        """The trajectory by a unit of the stamps and an order of the quaternions, by default the likeliest.

        Poses without stamps take those of `times` that have one for each frame; without such, t is the number of the
        frame. `oriented` False leaves the orientations out. Raises InputError where no times fit.
        """
        t, stamped = self._seconds(unit or (self.units[0] if self.units else TimeUnit.S), times)
        rotation = self.rotation_in(order or self.orders[0]) if oriented else None
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, 3] = self.position
        if rotation is not None:
            poses[:, :3, :3] = rotation
        return Trajectory(t, poses, self.name, self.source, self.line, stamped, oriented=rotation is not None)

    def rotation_in(self, order: Order) -> FloatArray | None:
        """(n, 3, 3) the rotations with quaternions in this order."""
        if order == self.orders[0] or self.quaternion is None or self.rotation is None:
            return self.rotation
        return so3.rotation_from_quaternion(_xyzw(self.quaternion, order))

    def covariance(self, order: Order | None = None) -> FloatArray | None:
        """(n, 6, 6) of the right perturbation [v, w] of each pose, m and rad; None without covariances."""
        rotation = self.rotation_in(order or self.orders[0])
        if self.covariance_numbers is None or rotation is None:
            return None
        return pose_covariances(self.covariance_numbers, rotation)

    @property
    def orientation_is_constant(self) -> bool:
        """Whether all poses have the same orientation, as files of positions in a format for poses do."""
        R = self.rotation
        return R is not None and len(R) > 1 and bool(np.abs(R - R[0]).max() < 1e-12)

    @property
    def has_positions_only(self) -> bool:
        """Whether there are no orientations, or one throughout although the path bends."""
        return self.rotation is None or (self.orientation_is_constant and bends(self.position))

    def _seconds(self, unit: TimeUnit, times: Sequence[FloatArray]) -> tuple[FloatArray, bool]:
        if self.stamps is not None:
            return self.stamps.seconds(unit), True
        frame = np.arange(len(self.position)) if self.frame is None else self.frame
        if not len(times):
            return frame.astype(np.float64), False
        if self.frame is not None:
            fitting = [t for t in times if len(t) > frame[-1] and frame[0] >= 0]
        else:
            fitting = [t for t in times if len(t) == len(frame)]
        if not fitting:
            counts = " or ".join(f"{len(t):,}" for t in times)
            last = f" to {frame[-1]}" if self.frame is not None else ""
            raise InputError(
                f"{self.source}: it has {len(frame):,} poses{last} but there are {counts} time stamps, and without a "
                "number on each line pose k is that of frame k; give --times for each file, one stamp for each pose"
            )
        return fitting[0][frame], True


def bends(position: FloatArray) -> bool:
    """Whether a path (n, 3) leaves a straight line by more than STRAIGHT of its extent."""
    if len(position) < 3:
        return False
    extent = np.linalg.svd(position - position.mean(axis=0), compute_uv=False)
    return bool(extent[1] > STRAIGHT * extent[0])


def read_trajectory(
    path: FilePath,
    form: TrajectoryFormat | None = None,
    times: FloatArray | None = None,
    name: str | None = None,
    *,
    time_unit: TimeUnit | None = None,
    quaternion: Order | None = None,
) -> Trajectory:
    """The trajectory in a TUM, KITTI, EuRoC or npz file, or another CSV, called `name` (the file's stem by default).

    The format is detected from the content; `form` insists on one. KITTI files have no time stamps: line k is taken at
    `times[k]`, s (see `read_times`); without times it is frame k, and the trajectory is not `stamped`. A file of
    another format has stamps of its own, and `times` is not looked at. `time_unit` and `quaternion` settle what the
    file leaves open. Raises InputError naming file and line (or pose) for a wrong count, what is no number, stamps that
    are not sorted or lost their digits, and poses that are no rigid motion.
    """
    file = read_trajectory_file(path, form, name)
    return file.trajectory(
        *settled(file, time_unit, quaternion), () if times is None else (times[: max(len(file.position), 1)],)
    )


def settled(file: TrajectoryFile, unit: TimeUnit | None, order: Order | None) -> tuple[TimeUnit, Order]:
    """The unit and order that a file has, or else the given ones, or else the likeliest.

    Raises InputError where the stamps may have several units, and seconds are not among them.
    """
    if unit is None and TimeUnit.S not in file.units and len(file.units) != 1:
        raise InputError(in_doubt(file))
    chosen = file.units[0] if unit is None or file.unit_settled else unit
    return chosen, (file.orders[0] if order is None or len(file.orders) == 1 else order)


def in_doubt(file: TrajectoryFile, units: Sequence[TimeUnit] | None = None) -> str:
    """What to say where the stamps of a file may have several units, or have none that fits a recorder."""
    assert file.stamps is not None
    possible = file.units if units is None else units
    if not possible:
        return (
            f"{file.source}: its poses are {file.stamps.interval:.3g} apart in time, which is none of a recorder in "
            "seconds, milliseconds, microseconds or nanoseconds; give --time-unit"
        )
    names = " or ".join(unit.noun for unit in possible)
    return (
        f"{file.source}: its time stamps, {file.stamps.interval:.3g} apart, may be in {names}; give --time-unit "
        f"{' or '.join(possible)}"
    )


def read_pose_covariances(path: FilePath) -> FloatArray | None:
    """The covariances (n, 6, 6) of the poses of a trajectory file; None for files that have none.

    They are those of the right perturbation [v, w], m and rad, one for each pose that `read_trajectory` gives.
    """
    return read_trajectory_file(path).covariance()


def read_tum(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s as they stand, strictly rising, and poses (n, 4, 4) `world_T_body` of a TUM file.

    Raises as `read_trajectory`.
    """
    read = read_trajectory_file(path, "tum").trajectory(TimeUnit.S, "xyzw")
    return read.t, read.world_T_body


def read_euroc(path: FilePath) -> tuple[FloatArray, FloatArray]:
    """Time stamps (n,), s, strictly rising, and poses (n, 4, 4) `world_T_body` of a EuRoC CSV.

    Raises as `read_trajectory`, and for stamps that are no whole nanoseconds.
    """
    read = read_trajectory(path, "euroc")
    return read.t, read.world_T_body


def read_kitti(path: FilePath) -> FloatArray:
    """Poses (n, 4, 4) `world_T_body` of a KITTI file; see `read_trajectory`."""
    return read_trajectory(path, "kitti").world_T_body


def read_trajectory_file(
    path: FilePath, form: TrajectoryFormat | None = None, name: str | None = None
) -> TrajectoryFile:
    """What a trajectory file holds and leaves open. Raises as `read_trajectory`."""
    if form is not None and form not in get_args(TrajectoryFormat):
        raise InputError(f"format: there is no '{form}'; known are {', '.join(get_args(TrajectoryFormat))}")
    with reading(path), np.errstate(all="ignore"):
        file = regular_file(path)
        empty = TrajectoryFile(name or file.stem.removesuffix(".txt"), shown(path), np.empty((0, 3)), None)
        if form == "npz" or (form is None and _is_zip(file)):
            return _of_npz(empty, file)
        lines = read_lines(file)
        lines.require_some()
        columns = named_columns(lines) if form != "kitti" else None
        named = columns is not None
        if columns is None:
            columns = counted_columns(lines, whole=form == "euroc" or _is_whole(lines))
        _require_form(form, lines, columns)
        if form == "euroc":
            columns = replace(columns, unit=columns.unit or "ns")
        read = _of_text(empty, lines, columns)
        if named or len(read.orders) == 1 or (lines.separator is None and lines.width in (8, 9, 20, 44)):
            return read
        said = " ".join(read.orders[0])
        return replace(read, remarks=(*read.remarks, f"no header names the order of its quaternions; {said} is usual"))


def _of_npz(empty: TrajectoryFile, file: Path) -> TrajectoryFile:
    t, poses, covariance = read_trajectory_npz(file)
    stamps = stamps_of([repr(stamp) for stamp in t.tolist()], t, None)
    units, is_settled = possible_units(stamps)
    return replace(
        empty,
        position=poses[:, :3, 3],
        rotation=poses[:, :3, :3],
        stamps=stamps,
        units=units,
        unit_settled=is_settled,
        covariance_numbers=covariance,
    )


def _of_text(empty: TrajectoryFile, lines: Lines, columns: Columns) -> TrajectoryFile:
    places = [*columns.matrix, *columns.position, *columns.quaternion, *columns.covariance]
    stamp = columns.time if columns.time is not None else columns.number
    table = numbers_of(lines, places if stamp is None else [stamp, *places], nan=True)
    if columns.nanoseconds is not None:
        numbers_of(lines, [columns.nanoseconds])
    pose = table.values if stamp is None else table.values[:, 1:]
    n_pose = len(columns.matrix) or len(columns.position) + len(columns.quaternion)
    kept, columns, remarks = _known(table, pose[:, :n_pose], columns, stamp is not None)
    if columns.remark:
        remarks.append(columns.remark)
    line, pose = table.line[kept], pose[kept]
    file = replace(empty, line=line, remarks=tuple(remarks))
    if stamp is not None:
        file, kept = _with_stamps(file, lines, columns, kept, table.values[kept, 0], pose[:, :n_pose])
        pose, line = pose[kept], line[kept]
        file = replace(file, line=line)
    if columns.matrix:
        poses = kitti_poses(pose[:, :12], line)
        position, rotation = poses[:, :3, 3], poses[:, :3, :3]
        return replace(file, position=position, rotation=rotation, up=_up_of_camera(position, rotation))
    position = pose[:, :3]
    file = replace(file, position=position)
    if not columns.quaternion:
        return replace(file, remarks=(*file.remarks, "it has positions and no orientations"))
    numbers = pose[:, 3:7]
    if not numbers.any():
        return replace(file, remarks=(*file.remarks, "its quaternions are zero: it has positions and no orientations"))
    order = columns.orders[0]
    shown_order = " ".join(f"q{axis}" for axis in order)
    return replace(
        file,
        rotation=rotations_of_quaternions(
            _xyzw(numbers, order), line, f"{shown_order} of length 1 behind the position (here as x y z w)"
        ),
        quaternion=numbers,
        orders=columns.orders,
        covariance_numbers=pose[:, 7:] if columns.covariance else None,
        remarks=(*file.remarks, *_covariance_remark(columns)),
    )


def _known(
    table: NumberTable, pose: FloatArray, columns: Columns, has_stamp: bool
) -> tuple[IntArray, Columns, list[str]]:
    """The lines (m,) that have a pose, the columns that they have, and what there is to remark."""
    if columns.quaternion and np.isnan(pose[:, 3:7]).all() and np.isfinite(pose[:, :3]).any():
        remarks = ["its quaternions are NaN: it has positions and no orientations"]
        columns, pose = replace(columns, quaternion=(), covariance=()), pose[:, :3]
    else:
        remarks = []
    unknown: BoolArray = np.asarray(np.isnan(pose).any(axis=1))
    if has_stamp and np.isnan(table.values[~unknown, 0]).any():
        i = int(np.flatnonzero(~unknown & np.isnan(table.values[:, 0]))[0])
        raise InputError(f"line {table.line[i]}: the time stamp is NaN; remove the line or mend it")
    if has_stamp:
        unknown |= np.isnan(table.values[:, 0])
    if unknown.all():
        raise InputError("every pose is NaN, so there is no trajectory; check that it is the right file")
    if unknown.any():
        count = int(unknown.sum())
        have = "has NaN in place of a pose and is" if count == 1 else "have NaN in place of a pose and are"
        remarks.append(f"{count:,} of {len(unknown):,} lines {have} left out")
    return np.flatnonzero(~unknown), columns, remarks


def _with_stamps(
    file: TrajectoryFile, lines: Lines, columns: Columns, kept: IntArray, value: FloatArray, pose: FloatArray
) -> tuple[TrajectoryFile, IntArray]:
    """The file with the stamps or frame numbers of the lines `kept`, and which of these (m,) are left."""
    place = columns.time if columns.time is not None else columns.number
    assert place is not None
    words = lines.column(place)
    rest = None if columns.nanoseconds is None else lines.column(columns.nanoseconds)
    stamps = stamps_of([words[i] for i in kept], value, columns.unit, None if rest is None else [rest[i] for i in kept])
    moved: BoolArray = np.asarray((np.diff(pose, axis=0) != 0).any(axis=1))
    reason = lost_digits(stamps, moved)
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
        said = f"{count:,} of {len(repeated):,} lines {'repeats' if count == 1 else 'repeat'} the time stamp before"
        remarks = (*remarks, f"{said}; the first pose is kept")
    if columns.time is None and stamps.whole is not None and max(map(abs, stamps.whole)) < 10**7:
        return replace(file, frame=np.array(stamps.whole, dtype=np.int64), remarks=remarks), left
    if stamps.unit == "ns" and stamps.whole is None:
        i = int(np.flatnonzero(stamps.value != np.floor(stamps.value))[0])
        raise InputError(
            f"line {line[i]}: the time stamp {words[kept[left[i]]]} is no whole number of nanoseconds; write those"
        )
    units, is_settled = possible_units(stamps)
    return replace(file, stamps=stamps, units=units, unit_settled=is_settled, remarks=remarks), left


def _covariance_remark(columns: Columns) -> tuple[str, ...]:
    if not columns.covariance:
        return ()
    if len(columns.covariance) == 12:
        return ("its covariances are read as OpenVINS writes them: rotation in the body, then position in the world",)
    return ("its covariances are read as in ROS: position, then rotation, both in the world",)


def _xyzw(numbers: FloatArray, order: Order) -> FloatArray:
    return numbers if order == "xyzw" else np.roll(numbers, -1, axis=1)


def _up_of_camera(position: FloatArray, rotation: FloatArray) -> FloatArray | None:
    """Up in the world of a camera; None where the body travels along its x axis, as no camera's frame does."""
    steps = np.einsum("tji,tj->ti", rotation[:-1], np.diff(position, axis=0))
    length = np.linalg.norm(steps, axis=1)
    moving = np.asarray(length > 0.1 * np.max(length, initial=0.0))
    if np.any(moving) and np.median(np.abs(steps[moving, 0]) / length[moving]) > FORWARD:
        return None
    return np.array(UP_OF_CAMERA)


def _is_whole(lines: Lines) -> bool:
    word = lines.words(0)[0]
    return word.partition(".")[0].isdecimal() and not word.partition(".")[2].strip("0")


def _require_form(form: TrajectoryFormat | None, lines: Lines, columns: Columns) -> None:
    """Raises InputError where the columns are not those of the format that is insisted on."""
    comma = lines.separator is not None
    wrong = {
        "tum": comma or bool(columns.matrix) or columns.time != 0,
        "euroc": not comma or bool(columns.matrix) or columns.time is None,
        "kitti": not columns.matrix,
    }
    expected = {
        "tum": "8 numbers (TUM) between blanks",
        "euroc": "8 or 17 numbers (EuRoC) between commas",
        "kitti": "12 numbers (KITTI)",
    }
    if form is not None and wrong.get(form):
        raise InputError(f"line {lines.number[0]}: expected {expected[form]}, got {lines.text[0][:60]!r}")


def _is_zip(file: Path) -> bool:
    with file.open("rb") as opened:
        return opened.read(4).startswith(ZIP)
