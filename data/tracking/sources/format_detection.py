"""The form of a recording of images, by its folders and its first bytes; and motion that is given beside it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from fgbaseline.geometry import InputError, se3

from ...formats.files.bag_file import METADATA, STORAGE, is_bag
from ...formats.files.file_errors import reading, shown
from ...formats.inertial.imu_attachment import read_imu
from ...formats.inertial.imu_yaml import NO_CALIBRATION, calibration_or_assumed, read_imu_calibration
from ...formats.inertial.velocity_csv import read_velocity_csv
from ...formats.trajectories.kitti import read_extrinsic
from .bags import open_bag
from .euroc import open_euroc
from .image_folders import open_two_folders
from .image_recording import ImageRecording
from .kitti_odometry import open_kitti_odometry
from .kitti_raw import open_kitti_raw

Cameras = Literal["stereo", "left"]
ARCHIVES = (b"PK\x03\x04", b"\x1f\x8b", b"7z\xbc\xaf", b"BZh", b"\xfd7zXZ", b"Rar!")
"""first bytes of archives that recordings are published in"""
FORMS = (
    "expected a EuRoC folder (mav0 or its parent), a KITTI odometry folder (image_0, image_1, calib.txt, times.txt), a "
    "KITTI raw drive (image_00, image_01, oxts), a ROS bag, two folders (LEFT --right RIGHT --calibration YAML) or one "
    "(LEFT --cameras left --calibration YAML)"
)


@dataclass(frozen=True, slots=True)
class ImageOptions:
    """Files given beside a recording of images, and which of its cameras are used."""

    cameras: Cameras | None = None
    """the left one alone, or a pair; None for a pair where there is one"""
    right: Path | None = None
    """folder of the right images, of two folders"""
    calibration: Path | None = None
    """YAML of the cameras"""
    times: Path | None = None
    """stamps of images whose names are none"""
    topics: tuple[str, ...] = ()
    """topics of a bag: left, right (without it, one camera) and, if any, the IMU"""
    imu: Path | None = None
    imu_calibration: Path | None = None
    velocities: Path | None = None
    extrinsic: Path | None = None
    """imu_T_cam of the left camera, 12 numbers on a line"""


def has_images(path: Path) -> bool:
    """Whether a path is a folder or a bag, and no file of tracks."""
    return path.is_dir() or is_bag(path)


def open_recording(path: Path, options: ImageOptions = ImageOptions()) -> ImageRecording:
    """The recording of images at `path`. Raises InputError that names what is missing."""
    recording = _open(path, options)
    if options.cameras == "stereo" and recording.right is None:
        raise InputError(f"cameras: {shown(path)} has one camera; leave out --cameras stereo")
    return _with_motion(recording, options)


def _open(path: Path, options: ImageOptions) -> ImageRecording:
    left_alone = options.cameras == "left"
    if is_bag(path):
        return open_bag(path, options.calibration, options.topics, left_alone=left_alone)
    if options.topics:
        raise InputError(f"topics: {shown(path)} is not a ROS bag")
    if path.is_file():
        with reading(path), path.open("rb") as file:
            packed = file.read(8).startswith(ARCHIVES)
        what = "is packed; unpack it and give its folder" if packed else f"is a file and no ROS bag; {FORMS}"
        raise InputError(f"{shown(path)}: it {what}")
    if not path.is_dir():
        raise InputError(f"{shown(path)}: there is no such folder of images or bag; {FORMS}")
    if options.right is not None and left_alone:
        raise InputError(f"right: {shown(options.right)} is given with --cameras left; leave out one of the two")
    if options.right is not None or (left_alone and options.calibration is not None):
        return open_two_folders(path, options.right, options.calibration, options.times)
    with reading(path):
        inside = sorted(path.iterdir())
    if not (path / METADATA).exists() and (stored := next((f for f in inside if f.suffix in STORAGE), None)):
        raise InputError(
            f"{shown(path / METADATA)} is missing, the description of a ROS 2 bag; give {stored.name} itself"
        )
    for name in ("calibration", "times"):
        if getattr(options, name) is not None:
            raise InputError(f"{name}: it belongs to folders of images; add --right FOLDER, or --cameras left for one")
    form = _form(path)
    if form is not None:
        return form(path, left_alone=left_alone)
    nearest = next((place for place in (*inside, *path.resolve().parents[:2]) if _form(place)), None)
    if nearest is not None:
        raise InputError(f"{shown(path)}: there is no recording in this folder; give {shown(nearest)}")
    raise InputError(f"{shown(path)}: there is no recording in this folder; {FORMS}")


def _form(folder: Path) -> Callable[..., ImageRecording] | None:
    """Reader of the form that a folder has by the names in it; None where it has none or cannot be read."""
    try:
        inside = {place.name for place in folder.iterdir() if place.is_dir()}
    except OSError:  # unreadable, or a file
        return None
    if inside & {"mav0", "cam0", "cam1"}:
        return open_euroc
    if inside & {"image_0", "image_1"} or (folder / "calib.txt").is_file():
        return open_kitti_odometry
    if inside & {"image_00", "image_01", "image_02", "oxts"} or any("_drive_" in name for name in inside):
        return open_kitti_raw
    return None


def _with_motion(recording: ImageRecording, options: ImageOptions) -> ImageRecording:
    if options.imu is not None and options.velocities is not None:
        raise InputError("imu: a recording has raw inertial samples or velocities; leave out --imu or --velocities")
    if options.imu_calibration is not None and options.imu is None:
        recording = _with_noise(recording, options.imu_calibration)
    if options.extrinsic is not None:
        imu_T_left = read_extrinsic(options.extrinsic)
        imu_T_before = imu_T_left @ se3.inverse(recording.left.imu_T_cam)
        right = None if recording.right is None else recording.right.on(imu_T_before)
        left = replace(recording.left, imu_T_cam=imu_T_left)
        recording = replace(recording, left=left, right=right, extrinsic_known=True)
    if options.velocities is not None:
        velocities = read_velocity_csv(options.velocities, recording.t)
        return replace(recording, velocities=velocities, imu=None)
    if options.imu is None:
        return recording
    raw = read_imu(options.imu, calibration_or_assumed(options.imu_calibration, NO_CALIBRATION))
    return replace(recording, imu=raw, imu_source=shown(options.imu), velocities=None)


def _with_noise(recording: ImageRecording, calibration: Path) -> ImageRecording:
    """The recording with the noise of a calibration in place of its own."""
    if recording.imu is None:
        raise InputError(f"imu-calibration: {shown(calibration)} is given without samples; add --imu FILE")
    found = read_imu_calibration(calibration)
    samples = replace(recording.imu.samples, noise=found.noise, gravity=found.gravity)
    remarks = (*recording.remarks, *found.remarks)
    return replace(recording, imu=recording.imu._replace(samples=samples), remarks=remarks)
