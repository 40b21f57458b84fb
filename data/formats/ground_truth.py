"""Ground truth from a file of its own, KITTI or TUM, brought to the recording's frames and to its world."""

from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3

from ..observations import IntArray
from ..sequence import Sequence, Truth
from ..time_unit import TimeUnit
from . import kitti, tum
from .named_file import FilePath, reading, regular_file, shown
from .number_table import read_numbers

BodyFrame = Literal["camera", "imu"]


def attach_truth(sequence: Sequence, path: FilePath, frame: BodyFrame | None) -> Sequence:
    """The recording with the truth of a KITTI file (12 numbers a line) or a TUM file (8 numbers a line).

    `frame` says whose poses they are: "camera" (the left one) or "imu". The result is `world_T_imu` with the world
    being the IMU's frame at frame 0. Line k of a KITTI file is frame k; frames beyond its end have no truth. In a TUM
    file the pose of a frame is the one nearest in time, if it lies within half the median interval of the frames; one
    pose belongs to one frame. Frames without truth are NaN and counted in a remark.

    It replaces what truth the recording has. Raises InputError naming file and line for bad text, and when `frame` is
    missing, the file has more lines than the recording has frames (KITTI), no stamp fits (TUM), or frame 0 has no pose.
    """
    if frame not in get_args(BodyFrame):
        raise InputError(
            f"{shown(path)}: the truth frame is {frame!r}; say whether the poses are those of the 'camera' or the 'imu'"
        )
    with reading(path), np.errstate(all="ignore"):
        poses, remarks = _poses_of_frames(sequence, path)
        if frame == "camera":
            poses = poses @ se3.inverse(sequence.imu_T_cam)
        truth = Truth.from_any_world(poses, source=shown(path))
        missing = sequence.n_frames - int(truth.known.sum())
        if missing:
            remarks.append(f"{missing} of {sequence.n_frames} frames have no ground truth in {shown(path)}.")
        return replace(sequence, truth=truth, remarks=(*sequence.remarks, *remarks))


def _poses_of_frames(sequence: Sequence, path: FilePath) -> tuple[FloatArray, list[str]]:
    """The poses (T, 4, 4) in the file's own world, NaN where it has none, and what there is to say of them."""
    table = read_numbers(regular_file(path), {tum.NUMBERS: "TUM", kitti.NUMBERS: "KITTI"})
    poses = np.full((sequence.n_frames, 4, 4), np.nan)
    if table.values.shape[1] == kitti.NUMBERS:
        lines = kitti.kitti_poses(table)
        n_frames = sequence.n_frames + len(sequence.left_out)
        if len(lines) > n_frames:
            raise InputError(
                f"it has {len(lines)} lines, but line k is frame k and the recording has only {n_frames} "
                "frames; give the truth of this recording, or cut off what lies beyond its end"
            )
        lines = np.delete(lines, [k for k in sequence.left_out if k < len(lines)], axis=0)
        poses[: len(lines)] = lines
        return poses, []
    t, recorded = tum.tum_poses(table)
    frames, nearest = match_stamps(sequence.t, t)
    other = _other_unit(sequence.t, t, len(frames))
    if not len(frames):
        raise InputError(
            f"none of its time stamps ({float(t[0])!r} to {float(t[-1])!r} s) is near one of the recording's "
            f"({float(sequence.t[0])!r} to {float(sequence.t[-1])!r} s); "
            + (other or "give the truth of this recording, on its clock")
        )
    poses[frames] = recorded[nearest]
    apart = float(np.abs(sequence.t[frames] - t[nearest]).max())
    remarks = [f"Ground truth is matched by time; stamps are up to {1e3 * apart:.3g} ms apart."] if apart else []
    if other:
        remarks.append(f"The ground truth has poses for {len(frames)} of {len(poses)} frames: {other}.")
    return poses, remarks


def _other_unit(t: FloatArray, recorded: FloatArray, matched: int) -> str:
    """Advice where stamps `recorded` fit the frames t (T,) in another unit than seconds, and far better."""
    for unit in (TimeUnit.MS, TimeUnit.US, TimeUnit.NS):
        fitting = len(match_stamps(t, recorded * unit.seconds)[0])
        if fitting > max(10 * matched, 0.5 * min(len(t), len(recorded))):
            fit = f"in which they fit {fitting} of the {len(t)} frames"
            return f"its stamps are in {unit.noun}, {fit}; write them in seconds"
    return ""


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
