"""Calibrations of one camera or a pair in YAML: EuRoC's `sensor.yaml`, Kalibr's camera chain, OpenCV's storage."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fgbaseline.geometry import FloatArray, InputError, se3

from ...formats.files.file_errors import FilePath, reading
from ...formats.files.yaml_file import pose, read_yaml
from ..rectification import CameraModel, Distortion

MODELS = {"radtan": Distortion.RADTAN, "radial-tangential": Distortion.RADTAN, "equidistant": Distortion.EQUIDISTANT}
LONGEST_BASELINE = 5.0
"""m; a longer one is taken for millimeters"""
ONE_CAMERA_KEYS = {"M1": "camera_matrix", "D1": "distortion_coefficients"}
COUNTS = {Distortion.RADTAN: (4, 5), Distortion.EQUIDISTANT: (4,), Distortion.NONE: (0,)}


class Rig(NamedTuple):
    """Left and right camera, or one camera."""

    left: CameraModel
    right: CameraModel | None
    extrinsic_known: bool
    time_shift: float = 0.0
    """s: t_imu = t_cam + time_shift (Kalibr's `timeshift_cam_imu`)"""
    remarks: tuple[str, ...] = ()


def read_sensor_yaml(path: Path) -> CameraModel:
    """Camera of EuRoC's `sensor.yaml`. Raises InputError naming file and key."""
    with reading(path):
        tree = read_yaml(path)
        return _camera(tree, "distortion_coefficients", pose(_value(tree, "T_BS"), "T_BS"))


def read_rig(path: FilePath, size: tuple[int, int] | None, *, left_alone: bool = False) -> Rig:
    """Rig of Kalibr's `camchain.yaml` or `camchain-imucam.yaml`, or of OpenCV's calibration; `left_alone` or of a pair.

    `size` is that of the images, px, where the file has none. Raises InputError naming file and key.
    """
    with reading(path):
        tree = read_yaml(path)
        rig = _kalibr(tree, left_alone) if "cam0" in tree else _opencv(tree, size, left_alone)
        if rig.right is None:
            return rig
        baseline = float(np.linalg.norm((se3.inverse(rig.left.imu_T_cam) @ rig.right.imu_T_cam)[:3, 3]))
        if baseline > LONGEST_BASELINE:
            raise InputError(f"the baseline is {baseline:.4g} m; write the translation in meters")
        return rig


def _kalibr(tree: dict[str, Any], left_alone: bool) -> Rig:
    if "cam1" not in tree and not left_alone:
        raise InputError("it has cam0 and no cam1; give the calibration of both cameras of the pair")
    chain = [tree[key] for key in (("cam0",) if left_alone else ("cam0", "cam1"))]
    if not all(isinstance(camera, dict) for camera in chain):
        raise InputError("cam0 or cam1 has no keys; give Kalibr's camchain.yaml")
    known = "T_cam_imu" in chain[0]
    imu_T_left = se3.inverse(pose(chain[0]["T_cam_imu"], "cam0: T_cam_imu")) if known else np.eye(4)
    poses = [imu_T_left, *(_right_pose(camera, imu_T_left, known) for camera in chain[1:])]
    left, *right = (
        _camera(camera, "distortion_coeffs", imu_T_cam) for camera, imu_T_cam in zip(chain, poses, strict=True)
    )
    shift = _float(chain[0].get("timeshift_cam_imu", 0.0), "cam0: timeshift_cam_imu")
    text = f"The cameras' stamps are moved by {1e3 * shift:+.3f} ms to the IMU's clock (timeshift_cam_imu)."
    return Rig(left, right[0] if right else None, known, shift, (text,) if shift else ())


def _right_pose(camera: dict[str, Any], imu_T_left: FloatArray, known: bool) -> FloatArray:
    """Pose imu_T_cam (4, 4) of cam1; `known` whether that of cam0 is in the file."""
    if "T_cn_cnm1" in camera:
        return imu_T_left @ se3.inverse(pose(camera["T_cn_cnm1"], "cam1: T_cn_cnm1"))
    if known and "T_cam_imu" in camera:
        return se3.inverse(pose(camera["T_cam_imu"], "cam1: T_cam_imu"))
    raise InputError("cam1: T_cn_cnm1 is missing, the pose of the left camera in the right one")


def _opencv(tree: dict[str, Any], size: tuple[int, int] | None, left_alone: bool) -> Rig:
    """Matrices of OpenCV's sample `stereo_calib`: M1, D1, M2, D2, R, T (right_T_left); of one camera M1, D1.

    One camera may also have the keys of OpenCV's sample `calibration`.
    """
    if left_alone:
        tree = tree | {key: tree[name] for key, name in ONE_CAMERA_KEYS.items() if name in tree}
    keys = ("M1", "D1") if left_alone else ("M1", "D1", "M2", "D2", "R", "T")
    missing = [key for key in keys if not isinstance(tree.get(key), np.ndarray)]
    if missing:
        raise InputError(
            f"{', '.join(missing)} is missing; give Kalibr's camchain.yaml ({'cam0' if left_alone else 'cam0, cam1'}), "
            f"or OpenCV's calibration with {', '.join(keys[:-1])} and {keys[-1]} in one file"
        )
    if size is None:
        raise InputError("the size of the images is not known; give images that can be read")
    poses = [np.eye(4)]
    if not left_alone:
        right_T_left = np.eye(4)
        right_T_left[:3, :3], right_T_left[:3, 3] = tree["R"], tree["T"].reshape(-1)
        poses.append(se3.inverse(pose(right_T_left, "R, T")))
    cameras = []
    for i, imu_T_cam in enumerate(poses, 1):
        K, D = tree[f"M{i}"], tuple(tree[f"D{i}"].reshape(-1).tolist())
        D = D[: max(4, max((k + 1 for k, value in enumerate(D) if value), default=0))]
        if len(D) > max(COUNTS[Distortion.RADTAN]):
            raise InputError(f"D{i}: it has {len(D)} coefficients; only k1, k2, p1, p2 and k3 are supported")
        intrinsics = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
        cameras.append(CameraModel(intrinsics, Distortion.RADTAN, D, size, imu_T_cam))
    return Rig(cameras[0], None if left_alone else cameras[1], extrinsic_known=False)


def _camera(tree: dict[str, Any], coefficients: str, imu_T_cam: FloatArray) -> CameraModel:
    kind = str(_value(tree, "camera_model"))
    if kind != "pinhole":
        raise InputError(f"camera_model is {kind[:40]!r}; only pinhole is supported")
    name = str(tree.get("distortion_model", "none")).lower()
    if name not in {*MODELS, "none"}:
        raise InputError(f"distortion_model is {name[:40]!r}; known are {', '.join(MODELS)} and none")
    distortion = MODELS.get(name, Distortion.NONE)
    D = tuple(_numbers(tree, coefficients)) if distortion is not Distortion.NONE else ()
    if len(D) not in COUNTS[distortion]:
        raise InputError(f"{coefficients}: expected {COUNTS[distortion][0]} numbers for {distortion}, got {len(D)}")
    intrinsics, size = _numbers(tree, "intrinsics"), _numbers(tree, "resolution")
    if len(intrinsics) != 4 or min(intrinsics) <= 0.0:
        raise InputError(f"intrinsics: expected fu, fv, cu and cv in pixels, got {intrinsics}")
    if len(size) != 2 or min(size) < 1:
        raise InputError(f"resolution: expected width and height in pixels, got {size}")
    fu, fv, cu, cv = intrinsics
    return CameraModel((fu, fv, cu, cv), distortion, D, (int(size[0]), int(size[1])), imu_T_cam)


def _value(tree: dict[str, Any], key: str) -> Any:
    if key not in tree:
        raise InputError(f"{key} is missing; give the calibration of the camera")
    return tree[key]


def _numbers(tree: dict[str, Any], key: str) -> list[float]:
    value = _value(tree, key)
    return [_float(each, key) for each in value] if isinstance(value, list) else [_float(value, key)]


def _float(value: Any, key: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{key}: expected a number, got {str(value)[:60]!r}") from None
    if not np.isfinite(number):
        raise InputError(f"{key}: expected a finite number, got {number}")
    return number
