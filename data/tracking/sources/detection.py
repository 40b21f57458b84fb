"""The form of a recording of images, by its folders and its first bytes; and motion that is given beside it."""

from dataclasses import dataclass, replace
from pathlib import Path

from fgbaseline.geometry import InputError, se3

from ...formats.bag_file import METADATA, STORAGE, is_bag
from ...formats.imu_attachment import read_imu
from ...formats.imu_yaml import NO_CALIBRATION, calibration_or_assumed, read_imu_calibration
from ...formats.named_file import shown
from ...formats.trajectory_reader import read_extrinsic
from ...formats.velocity_csv import read_velocity_csv
from .bags import open_bag
from .euroc import open_euroc
from .image_recording import ImageRecording
from .kitti_odometry import open_kitti_odometry
from .kitti_raw import open_kitti_raw
from .two_folders import open_two_folders

FORMS = (
    "expected a EuRoC folder (mav0 or its parent), a KITTI odometry folder (image_0, image_1, calib.txt, times.txt), a "
    "KITTI raw drive (image_00, image_01, oxts), a ROS bag, or two folders: LEFT --right RIGHT --calibration YAML"
)


@dataclass(frozen=True, slots=True)
class ImageOptions:
    """Files given beside a recording of images."""

    right: Path | None = None
    """folder of the right images, of two folders"""
    calibration: Path | None = None
    """YAML of the cameras"""
    times: Path | None = None
    """stamps of images whose names are none"""
    topics: tuple[str, ...] = ()
    """of a bag: left, right and, if any, the IMU"""
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
    return _with_motion(_open(path, options), options)


def _open(path: Path, options: ImageOptions) -> ImageRecording:
    if is_bag(path):
        return open_bag(path, options.calibration, options.topics)
    if options.topics:
        raise InputError(f"topics: {shown(path)} is no ROS bag")
    if not path.is_dir():
        raise InputError(f"{shown(path)}: there is no such folder of images or bag; {FORMS}")
    if options.right is not None:
        return open_two_folders(path, options.right, options.calibration, options.times)
    if not (path / METADATA).exists() and (stored := next((f for f in path.iterdir() if f.suffix in STORAGE), None)):
        raise InputError(
            f"{shown(path / METADATA)} is missing, the description of a ROS 2 bag; give {stored.name} itself"
        )
    for name in ("calibration", "times"):
        if getattr(options, name) is not None:
            raise InputError(f"{name}: it belongs to two folders of images; add --right FOLDER")
    if any((path / name).is_dir() for name in ("mav0", "cam0", "cam1")):
        return open_euroc(path)
    if any((path / name).is_dir() for name in ("image_0", "image_1")) or (path / "calib.txt").is_file():
        return open_kitti_odometry(path)
    inside = [folder.name for folder in path.iterdir() if folder.is_dir()]
    if {"image_00", "image_01"} & set(inside) or any("_drive_" in name for name in inside):
        return open_kitti_raw(path)
    raise InputError(f"{shown(path)}: there is no recording in this folder; {FORMS}")


def _with_motion(recording: ImageRecording, options: ImageOptions) -> ImageRecording:
    if options.imu is not None and options.velocities is not None:
        raise InputError("imu: a recording has raw inertial samples or velocities; leave out --imu or --velocities")
    if options.imu_calibration is not None and options.imu is None:
        recording = _with_noise(recording, options.imu_calibration)
    if options.extrinsic is not None:
        imu_T_left = read_extrinsic(options.extrinsic)
        left_T_right = se3.inverse(recording.left.imu_T_cam) @ recording.right.imu_T_cam
        left, right = (
            replace(camera, imu_T_cam=imu_T_cam)
            for camera, imu_T_cam in (
                (recording.left, imu_T_left),
                (recording.right, imu_T_left @ left_T_right),
            )
        )
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
