"""KITTI raw drive, synchronized and rectified.

```text
2011_09_26/
  calib_cam_to_cam.txt, calib_velo_to_cam.txt, calib_imu_to_velo.txt
  2011_09_26_drive_0002_sync/
    image_00/data/0000000000.png, timestamps.txt     image_01/ the same
    oxts/data/0000000000.txt, timestamps.txt
```
"""

from pathlib import Path

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3, so3

from ...formats.files.file_errors import reading, regular_file, shown
from ...observations import IntArray
from ...sequence import Truth
from ...wording import plural
from .image_files import file_pairs, image_files, size_of
from .image_recording import ONE_CAMERA, ImageRecording
from .kitti_odometry import rectified_cameras

CALIBRATIONS = ("calib_cam_to_cam.txt", "calib_velo_to_cam.txt", "calib_imu_to_velo.txt")
EARTH = 6378137.0
"""m, radius of the Mercator projection of KITTI's development kit"""
ONE_UNIT = "The velocities and the true poses are both from the OXTS unit: the truth is not independent of the motion."
NUMBERS = 30
"""numbers of a line of oxts, at least 25 of which are read"""
VELOCITY, RATE = slice(6, 8), slice(17, 20)
"""north and east, m/s; angular rates about the body's axes, rad/s"""
UPWARD = 10
Motion = tuple[FloatArray, FloatArray, FloatArray]
"""linear and angular velocity (T, 3) in the body, poses (T, 4, 4)"""


def open_kitti_raw(folder: Path, *, left_alone: bool = False) -> ImageRecording:
    """The drive in `folder`, or the only one inside it, with both cameras or the left one.

    Raises InputError that names what is missing.
    """
    drive = _drive(folder)
    if drive.name.endswith("_extract"):
        raise InputError(f"{shown(drive)}: these images are not rectified; use the drive that ends in _sync")
    folders = ("image_00",) if left_alone else ("image_00", "image_01")
    needed = [drive / name / part for name in folders for part in ("data", "timestamps.txt")]
    missing = next((path for path in needed if not path.exists()), None)
    if missing is not None:
        raise InputError(f"{shown(missing)} is missing; a KITTI raw drive has image_00 and image_01 with it")
    calibration = next((p for p in (drive, drive.parent) if (p / CALIBRATIONS[0]).is_file()), None)
    if calibration is None:
        raise InputError(f"{shown(drive.parent / CALIBRATIONS[0])} is missing; KITTI has it beside its drives")
    stamps = _stamps(drive / "image_00" / "timestamps.txt")
    numbered = [_numbered(drive / name / "data") for name in folders]
    frames = np.array(sorted(k for k in set.intersection(*map(set, numbered)) if k < len(stamps)))
    if len(frames) < 2:
        raise InputError(f"{shown(drive)}: {plural(len(frames), 'pair')} of images; a recording needs at least 2")
    alone = sum(map(len, numbered)) - len(folders) * len(frames)
    remarks = [ONE_CAMERA] if left_alone else []
    remarks += [f"{plural(alone, 'image')} without a partner or stamp: skipped."] if alone else []
    files = [tuple(each[k] for each in numbered) for k in frames.tolist()]
    values = _values(calibration / CALIBRATIONS[0])
    P0, P1 = (_matrix(values, f"P_rect_0{i}", 4, calibration / CALIBRATIONS[0]) for i in (0, 1))
    imu_T_cam = _extrinsic(calibration, values)
    cameras = rectified_cameras(P0, P1, size_of(files[0][0]), np.eye(4) if imu_T_cam is None else imu_T_cam)
    oxts = _oxts(drive / "oxts" / "data", frames)
    motion = None if oxts is None or imu_T_cam is None else _motion(oxts)
    files_of_motion = [drive / "oxts" / "data", *(calibration / name for name in CALIBRATIONS)]
    if motion is not None and (drive / "oxts" / "timestamps.txt").is_file():
        recorded = _stamps(drive / "oxts" / "timestamps.txt")
        if len(recorded) <= frames[-1]:
            raise InputError(f"{shown(drive)}: oxts/timestamps.txt has {len(recorded)} stamps, too few")
        motion = _at_images(motion, (stamps[frames] - recorded[frames]).astype(np.float64) * 1e-9)
    if motion is not None:
        remarks.append(ONE_UNIT)
    return ImageRecording(
        name=drive.name,
        form="kitti-raw",
        source=shown(folder),
        t=stamps[frames] / 1e9,
        pairs=file_pairs(files),
        left=cameras[0],
        right=None if left_alone else cameras[1],
        extrinsic_known=imu_T_cam is not None,
        velocities=None if motion is None else motion[:2],
        up_imu=None if motion is None else motion[2][0, 2, :3] / np.linalg.norm(motion[2][0, 2, :3]),
        truth=None if motion is None else Truth.from_any_world(motion[2], source="oxts"),
        absent=tuple(shown(path) for path in files_of_motion if not path.exists()),
        remarks=tuple(remarks),
    )


def _drive(folder: Path) -> Path:
    if any((folder / name).is_dir() for name in ("image_00", "image_01", "image_02", "oxts")):
        return folder.resolve()
    drives = sorted(p for p in folder.iterdir() if p.is_dir() and "_drive_" in p.name)
    if len(drives) != 1:
        names = ", ".join(p.name for p in drives[:4]) or "none"
        raise InputError(f"{shown(folder)}: expected one drive inside, got {names}; give the folder of one drive")
    return drives[0].resolve()


def _stamps(file: Path) -> IntArray:
    """Stamps (n,), ns since 1970."""
    with reading(file):
        lines = [line.strip() for line in regular_file(file).read_text().splitlines() if line.strip()]
        try:
            return np.array(lines, dtype="datetime64[ns]").astype(np.int64)
        except ValueError:
            raise InputError("expected lines such as 2011-09-26 13:02:44.334126592") from None


def _numbered(folder: Path) -> dict[int, Path]:
    return {int(file.stem): file for file in image_files(folder) if file.stem.isdecimal()}


def _values(file: Path) -> dict[str, FloatArray]:
    with reading(file):
        found = {}
        for line in regular_file(file).read_text().splitlines():
            key, _, numbers = line.partition(":")
            try:
                found[key.strip()] = np.array(numbers.split(), dtype=np.float64)
            except ValueError:
                continue  # the date
        return found


def _matrix(values: dict[str, FloatArray], key: str, columns: int, file: Path) -> FloatArray:
    if key not in values or len(values[key]) != 3 * columns:
        raise InputError(f"{shown(file)}: {key} of {3 * columns} numbers is missing; give KITTI's calibration")
    return values[key].reshape(3, columns)


def _rigid(file: Path) -> FloatArray:
    values = _values(file)
    motion = np.eye(4)
    motion[:3, :3] = so3.nearest_rotations(_matrix(values, "R", 3, file)[None])[0]
    motion[:3, 3:] = _matrix(values, "T", 1, file)
    return motion


def _extrinsic(folder: Path, cameras: dict[str, FloatArray]) -> FloatArray | None:
    """`imu_T_cam` (4, 4) of the rectified left camera; None where its files are missing."""
    if not all((folder / name).is_file() for name in CALIBRATIONS):
        return None
    velodyne, imu = (_rigid(folder / name) for name in CALIBRATIONS[1:])
    rectified = np.eye(4)
    rectified[:3, :3] = so3.nearest_rotations(_matrix(cameras, "R_rect_00", 3, folder / CALIBRATIONS[0])[None])[0]
    return np.asarray(se3.inverse(rectified @ velodyne @ imu))


def _oxts(folder: Path, frames: IntArray) -> FloatArray | None:
    """Lines (T, 25) of the unit for the frames (T,); None where there are none. Raises InputError for a missing one."""
    if not folder.is_dir():
        return None
    lines = []
    for k in frames.tolist():
        file = folder / f"{k:010d}.txt"
        with reading(file):
            words = regular_file(file).read_text().split()
            try:
                lines.append(np.array(words[:25], dtype=np.float64))
            except ValueError:
                raise InputError(f"expected {NUMBERS} numbers, got {' '.join(words)[:60]!r}") from None
            if len(lines[-1]) < 25:
                raise InputError(f"expected {NUMBERS} numbers, got {len(words)}")
    return np.array(lines)


def _motion(oxts: FloatArray) -> Motion:
    """Linear and angular velocity (T, 3) in the body, and poses (T, 4, 4) in east, north, up (Mercator)."""
    latitude, longitude, altitude, roll, pitch, yaw = oxts[:, :6].T
    Rx, Ry, Rz = (so3.exp_so3(angle[:, None] * axis) for angle, axis in zip((roll, pitch, yaw), np.eye(3), strict=True))
    poses = np.tile(np.eye(4), (len(oxts), 1, 1))
    poses[:, :3, :3] = Rz @ Ry @ Rx
    scale = EARTH * np.cos(np.deg2rad(latitude[0]))
    poses[:, 0, 3] = scale * np.deg2rad(longitude)
    poses[:, 1, 3] = scale * np.log(np.tan(np.pi / 4.0 + np.deg2rad(latitude) / 2.0))
    poses[:, 2, 3] = altitude
    north, east = oxts[:, VELOCITY].T
    velocity = np.stack([east, north, oxts[:, UPWARD]], axis=1)
    return np.einsum("tji,tj->ti", poses[:, :3, :3], velocity), oxts[:, RATE].copy(), poses


def _at_images(motion: Motion, later: FloatArray) -> Motion:
    """The motion at images that are `later` (T,), s, than the lines of the unit: some milliseconds."""
    linear, angular, poses = motion
    return linear, angular, poses @ se3.exp(np.hstack([linear, angular]) * later[:, None])
