"""Stereo rig: camera, image size and extrinsic."""

from dataclasses import dataclass, field

import numpy as np

from fgbaseline.geometry import FloatArray, StereoCamera, so3

from ..axis_conventions import AXIS_CONVENTIONS, axes_matrix
from ..sequence import Sequence

_IMU_R_CAM = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""camera z forward, x right, y down in a body with x forward, y left, z up"""


def mounted(position: tuple[float, float, float], misalignment: tuple[float, float, float]) -> FloatArray:
    """`imu_T_cam` (4, 4) of a camera that looks forward, on an IMU with x forward, y left, z up.

    `position` in the IMU's frame (m), turned in its own axes by the small rotation vector `misalignment` (rad).
    """
    imu_T_cam = np.eye(4)
    imu_T_cam[:3, :3] = _IMU_R_CAM @ so3.exp_so3(misalignment)
    imu_T_cam[:3, 3] = position
    return imu_T_cam


@dataclass(frozen=True, eq=False, slots=True)
class Rig:
    """A stereo camera on an IMU, on a body with x forward, y left, z up; the IMU may be mounted in other axes."""

    camera: StereoCamera
    width: int
    """width of the images, px"""
    height: int
    imu_T_cam: FloatArray = field(repr=False)
    """(4, 4) extrinsic of the left camera"""
    imu_above_ground: float
    """m, where the rig drives on a road"""

    @property
    def body_pose(self) -> FloatArray:
        """`imu_T_body` (4, 4): of the 24 ways to mount an IMU the one by which the camera looks most nearly ahead."""
        looks = self.imu_T_cam[:3, :3] @ _IMU_R_CAM.T
        imu_T_body = np.eye(4)
        imu_T_body[:3, :3] = max(map(axes_matrix, AXIS_CONVENTIONS), key=lambda axes: float(np.sum(axes * looks)))
        return imu_T_body


def rig_of(sequence: Sequence) -> Rig:
    """The rig that recorded a sequence; images are taken to be as large as its observations or twice its center say."""
    camera, pixel = sequence.stereo_camera, sequence.observations.pixel
    corner = pixel[:, :2].max(axis=0, initial=0.0)
    return Rig(
        camera=camera,
        width=int(np.ceil(max(corner[0], 2.0 * camera.cu))),
        height=int(np.ceil(max(corner[1], 2.0 * camera.cv))),
        imu_T_cam=sequence.imu_T_cam,
        imu_above_ground=KITTI.imu_above_ground,
    )


KITTI = Rig(
    camera=StereoCamera(718.856, 718.856, 607.193, 185.216, 0.537),
    width=1241,
    height=376,
    imu_T_cam=mounted((1.144, -0.313, 0.727), (0.0085, -0.0011, 0.0068)),
    imu_above_ground=0.93,
)
"""a car of the KITTI set"""

HANDHELD = Rig(
    camera=StereoCamera(484.5, 484.5, 321.7, 247.5, 0.24),
    width=640,
    height=480,
    imu_T_cam=mounted((0.05, 0.12, 0.03), (0.012, -0.008, 0.005)),
    imu_above_ground=1.4,
)
"""a rig as in the UTIAS `dataset3`, carried about a room"""
