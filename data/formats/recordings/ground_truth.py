"""Ground truth from a trajectory file, associated with the recording's frames and transformed to its world."""

from dataclasses import replace
from functools import reduce
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3, so3

from ...observations import IntArray
from ...problem.inertial import imu_intervals
from ...sequence import Sequence, Truth
from ...time_unit import TimeUnit
from ...trajectory import Trajectory
from ..files.file_errors import FilePath, reading, shown
from ..inertial.ground_truth import inertial_truth, with_state
from ..stamps.common_time_unit import units_in_common
from ..trajectories.columns import Order
from ..trajectories.parsed_trajectory import ParsedTrajectory, unit_and_order
from ..trajectories.quaternion_order import STEP, fits_clearly_better, in_words
from ..trajectories.reader import read_trajectory_file

BodyFrame = Literal["camera", "imu"]
FASTER = 3.0
"""factor on the recording's interval: lines that are farther apart are not one for each frame"""


def attach_truth(sequence: Sequence, path: FilePath | Trajectory, frame: BodyFrame | None) -> Sequence:
    """The recording with the truth of a trajectory file (see `read_trajectory_file`), or of a trajectory in memory.

    `frame` is the body whose poses they are: "camera" (the left one) or "imu". The result is `world_T_imu` with the
    world being the IMU's frame at frame 0. Line k of a KITTI file is frame k, or that of its number; frames beyond its
    end have no truth. In a file with stamps the pose of a frame is the one nearest in time, if it lies within half the
    median interval of the frames; one pose belongs to one frame. Frames without truth are NaN and counted in a remark.

    With raw inertial samples the poses keep the axes of the file's world, and frame 0 may be without one. A comment
    `# up x y z` of the file is then `Truth.up`; without raw samples it is `Sequence.up_imu`.

    It replaces what truth the recording has. Raises InputError naming file and line for bad text, and when `frame` is
    missing, the file has more lines than the recording has frames (KITTI), no stamp fits (TUM), or frame 0 has no pose.
    """
    name = (path.source or path.name) if isinstance(path, Trajectory) else shown(path)
    if frame not in get_args(BodyFrame):
        raise InputError(
            f"{name}: the truth frame is {frame!r}; say whether the poses are those of the 'camera' or the 'imu'"
        )
    with reading(name), np.errstate(all="ignore"):
        up = None
        if isinstance(path, Trajectory):
            poses, line, remarks = _matched(sequence, path)
        else:
            file = read_trajectory_file(path)
            up = file.up if file.up_stated else None
            poses, line, remarks = _poses_of_frames(sequence, file, frame)
        if frame == "camera":
            poses = poses @ se3.inverse(sequence.imu_T_cam)
        inertial = sequence.imu is not None
        truth = inertial_truth(poses, name) if inertial else Truth.from_any_world(poses, source=name)
        if inertial and frame == "imu" and not isinstance(path, Trajectory):
            truth = with_state(truth, path, line)
        if up is not None and inertial:
            truth = replace(truth, up=up)
        elif up is not None:
            sequence = replace(sequence, up_imu=poses[0, :3, :3].T @ up)
        missing = sequence.n_frames - int(truth.known.sum())
        if missing:
            remarks.append(f"{missing} of {sequence.n_frames} frames have no ground truth in {name}.")
        return replace(sequence, truth=truth, remarks=(*sequence.remarks, *remarks))


def _matched(sequence: Sequence, path: Trajectory) -> tuple[FloatArray, IntArray, list[str]]:
    """Poses, line numbers and remarks as of `_poses_of_frames`, from a trajectory in memory."""
    if not path.oriented:
        raise InputError("it has positions without orientations, which a run needs to bring it to its own world")
    poses, line = np.full((sequence.n_frames, 4, 4), np.nan), np.full(sequence.n_frames, -1, dtype=np.int64)
    frames, nearest = match_stamps(sequence.t, path.t)
    if not len(frames):
        raise _no_stamp_fits(sequence, path)
    poses[frames] = path.world_T_body[nearest]
    return poses, line, _apart(sequence, path, frames, nearest)


def _no_stamp_fits(sequence: Sequence, path: Trajectory) -> InputError:
    return InputError(
        f"none of its time stamps ({float(path.t[0])!r} to {float(path.t[-1])!r} s) is near one of the recording's "
        f"({float(sequence.t[0])!r} to {float(sequence.t[-1])!r} s); give the truth of this recording, on its clock"
    )


def _apart(sequence: Sequence, path: Trajectory, frames: IntArray, nearest: IntArray) -> list[str]:
    """The remark on stamps that differ."""
    apart = float(np.abs(sequence.t[frames] - path.t[nearest]).max())
    return [f"Ground truth is matched by time; stamps are up to {1e3 * apart:.3g} ms apart."] if apart else []


def _poses_of_frames(
    sequence: Sequence, file: ParsedTrajectory, frame: BodyFrame | None
) -> tuple[FloatArray, IntArray, list[str]]:
    """The poses (T, 4, 4) in the file's own world, NaN where it has none, their lines (T,) and what there is to say."""
    if file.has_positions_only:
        raise InputError(
            "it has positions without orientations, which a run needs to bring it to its own world; run without it and "
            "compare the run with it: fgbaseline compare TRUTH trajectories/NAME.tum --lever-arm X,Y,Z"
        )
    remarks = [f"{file.source}: {remark}." for remark in file.remarks]
    poses = np.full((sequence.n_frames, 4, 4), np.nan)
    if file.stamps is None:
        frames, lines = _frames(sequence, file)
        poses[frames] = file.trajectory().world_T_body[lines]
        return poses, _lines(file, sequence.n_frames, frames, lines), remarks
    unit = _unit(sequence, file)
    if unit is not TimeUnit.S:
        remarks.append(f"The time stamps of {file.source} are in {unit.noun}: divided by {unit.per_second:,}.")
    read = file.trajectory(unit)
    frames, nearest = match_stamps(sequence.t, read.t)
    order = _order(sequence, file, frame, frames, nearest)
    if order != file.orders[0]:
        remarks.append(
            f"The quaternions of {file.source} are read as {in_words(order)}: so they turn as the gyroscope."
        )
        read = file.trajectory(unit, order)
    if not len(frames):
        raise _no_stamp_fits(sequence, read)
    poses[frames] = read.world_T_body[nearest]
    remarks += _apart(sequence, read, frames, nearest)
    return poses, _lines(file, sequence.n_frames, frames, nearest), remarks


def _lines(file: ParsedTrajectory, n_frames: int, frames: IntArray, index: IntArray) -> IntArray:
    """Lines (T,) of the file that the poses of the frames are on; -1 for a frame without a pose."""
    line = np.full(n_frames, -1, dtype=np.int64)
    if file.line is not None:
        line[frames] = file.line[index]
    return line


def _order(
    sequence: Sequence, file: ParsedTrajectory, frame: BodyFrame | None, frames: IntArray, nearest: IntArray
) -> Order:
    """The order of quaternions with which the truth turns as the gyroscope measured, clearly; else the usual one."""
    if len(file.orders) == 1 or len(frames) <= STEP:
        return file.orders[0]
    turned = _turned(sequence)
    body_R_imu = sequence.imu_T_cam[:3, :3].T if frame == "camera" else np.eye(3)

    def over_steps(R: FloatArray) -> FloatArray:
        return np.asarray(np.swapaxes(R[:-STEP], 1, 2) @ R[STEP:])

    measured = over_steps(turned[frames])
    misfits = []
    for order in file.orders:
        rotation = file.rotation_in(order)
        assert rotation is not None
        true = over_steps(rotation[nearest] @ body_R_imu)
        misfits.append(float(np.rad2deg(np.median(so3.rotation_angle(np.swapaxes(measured, 1, 2) @ true)))))
    return file.orders[int(fits_clearly_better(misfits[1], misfits[0]))]


def _turned(sequence: Sequence) -> FloatArray:
    """Rotations (T, 3, 3) of the frames since frame 0, integrated from the gyroscope."""
    if sequence.imu is None:
        increments = so3.exp_so3(sequence.angular_velocity[:-1] * sequence.dt[:, None])
    else:
        pieces = imu_intervals(sequence.imu, sequence.t)
        steps = so3.exp_so3(pieces.angular_velocity * pieces.dt[:, None])
        ends = pieces.starts.tolist()
        increments = np.array([reduce(np.matmul, steps[a:b], np.eye(3)) for a, b in pairwise(ends)])
    turned = np.tile(np.eye(3), (sequence.n_frames, 1, 1))
    for k, increment in enumerate(increments):
        turned[k + 1] = turned[k] @ increment
    return turned


def _frames(sequence: Sequence, file: ParsedTrajectory) -> tuple[IntArray, IntArray]:
    """The frames (n,) of poses without stamps, by their numbers, else line by line, and which poses (n,) they are.

    Frames of the recording's file that it leaves out count, and their poses are left out.
    """
    n, recorded = len(file.position), sequence.n_frames + len(sequence.left_out)
    if file.frame is not None:
        if file.frame[0] < 0 or file.frame[-1] >= recorded:
            raise InputError(
                f"its frames are numbered {file.frame[0]} to {file.frame[-1]}, but the recording has only "
                f"{recorded}; give the truth of this recording"
            )
    elif n > recorded:
        raise InputError(
            f"it has {n} lines, but line k is frame k and the recording has only {recorded} "
            "frames; give the truth of this recording, or cut off what lies beyond its end"
        )
    else:
        _require_same_speed(sequence, file)
    number = np.full(recorded, -1)
    number[np.delete(np.arange(recorded), list(sequence.left_out))] = np.arange(sequence.n_frames)
    frame = number[np.arange(n) if file.frame is None else file.frame]
    return frame[frame >= 0], np.flatnonzero(frame >= 0)


def _require_same_speed(sequence: Sequence, file: ParsedTrajectory) -> None:
    """Raises InputError where the recording moves much less from frame to frame than the file from line to line."""
    if sequence.imu is not None:
        return  # its speed is not known yet
    n = len(file.position)
    steps = np.linalg.norm(sequence.linear_velocity[:-1], axis=1) * sequence.dt
    recorded = np.median(steps[: n - 1]) if n > 1 else 0
    true = np.median(np.linalg.norm(np.diff(file.position, axis=0), axis=1)) if n > 1 else 0
    if n < sequence.n_frames and true > FASTER * recorded > 0:
        raise InputError(
            f"it has {n} poses for {sequence.n_frames} frames, {true / recorded:.1f} times as far apart as the "
            "recording moves from frame to frame: line k is not frame k; number the lines (13 columns), or give a TUM "
            "file with stamps"
        )


def _unit(sequence: Sequence, file: ParsedTrajectory) -> TimeUnit:
    """Unit of the stamps; an ambiguous one is that in which they share the most time with the recording."""
    assert file.stamps is not None
    spans = {unit: (float(t[0]), float(t[-1])) for unit in file.units for t in (file.stamps.seconds(unit),)}
    found = units_in_common({TimeUnit.S: (float(sequence.t[0]), float(sequence.t[-1]))}, spans)
    if found is None:
        unit, _ = unit_and_order(file, None, None)
        return unit
    return found[1]


def match_stamps(t: FloatArray, recorded: FloatArray) -> tuple[IntArray, IntArray]:
    """Frames (m,) of the stamps t (T,) and for each the index (m,) of the stamp of `recorded` (n,) that belongs to it.

    Nearest in time, at most half the median interval of t away; where one stamp is nearest to several frames, it
    belongs to the nearest of these. Both arrays rise strictly.
    """
    after = np.clip(np.searchsorted(recorded, t), 1, max(len(recorded) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(recorded) - 1)
    nearest = np.where(np.abs(recorded[after] - t) < np.abs(t - recorded[before]), after, before)
    apart = np.abs(recorded[nearest] - t)
    best = np.full(len(recorded), np.inf)
    np.minimum.at(best, nearest, apart)
    frames = np.flatnonzero((apart <= 0.5 * np.median(np.diff(t))) & (apart == best[nearest]))
    chosen, first = np.unique(nearest[frames], return_index=True)
    return frames[first], chosen
