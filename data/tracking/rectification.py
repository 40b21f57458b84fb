"""Cameras with distortion and extrinsics, and the rectification of a stereo pair or of one camera (OpenCV)."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import Camera, FloatArray, InputError, MonocularCamera, StereoCamera, se3

from .opencv import opencv

Image = NDArray[np.uint8]
ALIGNED = 1e-6
"""largest rotation (rad) and displacement off the x axis (share of the baseline) of a pair that is rectified already"""


class Distortion(StrEnum):
    """Distortion models, under their names in Kalibr; EuRoC's `radial-tangential` is the first."""

    RADTAN = "radtan"
    EQUIDISTANT = "equidistant"
    NONE = "none"


@dataclass(frozen=True, eq=False, slots=True)
class CameraModel:
    """Pinhole camera with distortion and its pose on the IMU."""

    intrinsics: tuple[float, float, float, float]
    """fu, fv, cu, cv, px"""
    distortion: Distortion
    coefficients: tuple[float, ...]
    """k1, k2, p1, p2 (radtan, optionally k3) or k1 to k4 (equidistant); empty without distortion"""
    size: tuple[int, int]
    """width and height, px"""
    imu_T_cam: FloatArray
    """(4, 4)"""

    @property
    def K(self) -> FloatArray:  # noqa: N802
        """Camera matrix (3, 3)."""
        fu, fv, cu, cv = self.intrinsics
        return np.array([[fu, 0.0, cu], [0.0, fv, cv], [0.0, 0.0, 1.0]])

    def on(self, imu_T_body: FloatArray) -> "CameraModel":
        """The camera on an IMU, its pose being given on a body; `imu_T_body` (4, 4)."""
        return replace(self, imu_T_cam=imu_T_body @ self.imu_T_cam)


class Rectified(NamedTuple):
    """Rectified pair of a rig, or the undistorted image of one camera."""

    camera: Camera
    imu_T_cam: FloatArray
    """(4, 4) of the rectified left camera"""
    maps: tuple[tuple[Any, Any], ...] | None
    """OpenCV's maps of each image, the left one first; None where the images are rectified already"""

    def __call__(self, *images: Image) -> tuple[Image, ...]:
        """Rectified images of a pair, or of one camera."""
        if self.maps is None:
            return images
        cv2 = opencv()
        return tuple(cv2.remap(image, *maps, cv2.INTER_LINEAR) for image, maps in zip(images, self.maps, strict=True))


def rectify(left: CameraModel, right: CameraModel | None) -> Rectified:
    """Rectification of a pair (Bouguet's, `cv2.stereoRectify`). Raises InputError for what is no stereo pair.

    A pair without distortion, with equal cameras displaced along x only, is used as it is. A pair of fisheye cameras
    keeps its focal length, so that the image's middle keeps its resolution; what a pinhole camera of this focal length
    and size does not see is left out. Without a right camera the distortion of the left one is removed.
    """
    if right is None:
        return _undistorted(left)
    if left.size != right.size:
        raise InputError(f"images: the left camera has {left.size} px, the right one {right.size}; they must be equal")
    if left.distortion is not right.distortion:
        raise InputError(f"images: the cameras have two distortion models, {left.distortion} and {right.distortion}")
    right_T_left = se3.inverse(right.imu_T_cam) @ left.imu_T_cam
    baseline = float(np.linalg.norm(right_T_left[:3, 3]))
    if not baseline > 0.0:
        raise InputError("images: both cameras are at one place; the extrinsics of a stereo pair differ")
    if right_T_left[0, 3] > 0.0:
        raise InputError("images: the second camera is to the left of the first; give the left camera first")
    if abs(right_T_left[0, 3]) < 0.7 * baseline:
        raise InputError("images: the cameras are not side by side; pairs above each other are not supported")
    if _is_rectified(left, right, right_T_left, baseline):
        fu, fv, cu, cv = left.intrinsics
        return Rectified(StereoCamera(fu, fv, cu, cv, baseline), left.imu_T_cam, None)
    cv2, R, t = opencv(), right_T_left[:3, :3].copy(), right_T_left[:3, 3:].copy()
    D = [np.array(model.coefficients) for model in (left, right)]
    if left.distortion is Distortion.EQUIDISTANT:
        R1, R2, *_ = cv2.fisheye.stereoRectify(left.K, D[0], right.K, D[1], left.size, R, t, flags=0)
        P1 = P2 = _centered(float(np.mean([left.intrinsics[:2], right.intrinsics[:2]])), left.size)
        init = cv2.fisheye.initUndistortRectifyMap
    else:
        R1, R2, P1, P2, *_ = cv2.stereoRectify(
            left.K, D[0], right.K, D[1], left.size, R, t, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0
        )
        init = cv2.initUndistortRectifyMap
    maps = tuple(
        init(model.K, d, turn, projection, model.size, cv2.CV_16SC2)
        for model, d, turn, projection in zip((left, right), D, (R1, R2), (P1, P2), strict=True)
    )
    camera = StereoCamera(float(P1[0, 0]), float(P1[1, 1]), float(P1[0, 2]), float(P1[1, 2]), baseline)
    turn = np.eye(4)
    turn[:3, :3] = R1.T
    return Rectified(camera, left.imu_T_cam @ turn, maps)


def _undistorted(model: CameraModel) -> Rectified:
    """One camera without distortion, with the largest image whose pixels are all known."""
    if model.distortion is not Distortion.EQUIDISTANT and not any(model.coefficients):
        return Rectified(MonocularCamera(*model.intrinsics), model.imu_T_cam, None)
    cv2, D = opencv(), np.array(model.coefficients)
    if model.distortion is Distortion.EQUIDISTANT:
        K = cv2.fisheye.estimateNewCameraMatrixForUndistortRectify(model.K, D, model.size, np.eye(3), balance=0.0)
        init = cv2.fisheye.initUndistortRectifyMap
    else:
        K, _ = cv2.getOptimalNewCameraMatrix(model.K, D, model.size, 0.0)
        init = cv2.initUndistortRectifyMap
    maps = init(model.K, D, np.eye(3), K, model.size, cv2.CV_16SC2)
    camera = MonocularCamera(float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    return Rectified(camera, model.imu_T_cam, (maps,))


def _centered(focal_length: float, size: tuple[int, int]) -> FloatArray:
    """Camera matrix (3, 3) with the principal point in the middle of the image."""
    width, height = size
    return np.array([[focal_length, 0.0, (width - 1) / 2], [0.0, focal_length, (height - 1) / 2], [0.0, 0.0, 1.0]])


def _is_rectified(left: CameraModel, right: CameraModel, right_T_left: FloatArray, baseline: float) -> bool:
    turned = np.linalg.norm(se3.log(right_T_left)[3:])
    off_axis = np.linalg.norm(right_T_left[1:3, 3]) / baseline
    equal = left.intrinsics == right.intrinsics and not any(left.coefficients) and not any(right.coefficients)
    equal &= left.distortion is not Distortion.EQUIDISTANT  # which maps angles also where its coefficients are 0
    return bool(equal and turned < ALIGNED and off_axis < ALIGNED)
