"""Stereo images of a room with textured walls, seen by a rig that moves in a known way; and folders of them."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from fgbaseline.geometry import FloatArray, StereoCamera, se3, so3

CAMERA = StereoCamera(fu=260.0, fv=260.0, cu=159.5, cv=119.5, baseline=0.12)
WIDTH, HEIGHT = 320, 240
IMU_T_CAM = np.array([[0.0, 0.0, 1.0, 0.1], [-1.0, 0.0, 0.0, 0.06], [0.0, -1.0, 0.0, 0.02], [0.0, 0.0, 0.0, 1.0]])
"""x forward, y left and z up, as a car has it"""
WALLS = (
    (np.array([1.0, 0.0, 0.0]), 4.0),
    (np.array([0.0, 1.0, 0.0]), 1.8),
    (np.array([0.0, -1.0, 0.0]), 1.6),
    (np.array([0.0, 0.0, -1.0]), 1.2),
    (np.array([0.0, 0.0, 1.0]), 1.4),
)
"""normals (3,) in the world, z up, and distances from the origin, m: a box without its back"""
TEXELS = 80.0
"""per meter"""
START_NS = 1_403_715_273_000_000_000
RATE, IMU_RATE = 20, 200
SPEED = 0.6
"""m/s along x"""
YAW = 0.08
"""rad, of a slow swing of the heading"""


@dataclass(frozen=True, eq=False)
class Room:
    """Frames of the rig in the room."""

    n_frames: int
    seed: int = 0

    @cached_property
    def stamps(self) -> list[int]:
        return [START_NS + k * 10**9 // RATE for k in range(self.n_frames)]

    @cached_property
    def world_T_imu(self) -> FloatArray:  # noqa: N802
        return self.poses_at(np.arange(self.n_frames) / RATE)

    @staticmethod
    def poses_at(t: FloatArray) -> FloatArray:
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, :3] = so3.exp_so3(np.stack([0 * t, 0 * t, YAW * np.sin(2.0 * t)], axis=1))
        poses[:, 0, 3] = SPEED * t
        return poses

    def imu(self) -> tuple[list[int], FloatArray]:
        """Stamps, ns, and samples (M, 6) of angular velocity and specific force."""
        n = self.n_frames * IMU_RATE // RATE + 1
        t = np.arange(n) / IMU_RATE
        R = self.poses_at(t)[:, :3, :3]
        rate = np.stack([0 * t, 0 * t, 2.0 * YAW * np.cos(2.0 * t)], axis=1)
        return [START_NS + k * 10**9 // IMU_RATE for k in range(n)], np.hstack(
            [rate, R.transpose(0, 2, 1) @ [0, 0, 9.81]]
        )

    @cached_property
    def textures(self) -> list[NDArray[np.float32]]:
        rng = np.random.default_rng(self.seed)
        found = []
        for _ in WALLS:
            noise = rng.standard_normal((1024, 1024)).astype(np.float32)
            image = sum(gaussian_filter(noise, s, mode="wrap") * s for s in (2.0, 5.0))
            found.append(np.clip(128.0 + 60.0 * image / image.std(), 0, 255).astype(np.float32))
        return found

    def points(self, k: int, pixel: FloatArray, right: bool = False) -> tuple[FloatArray, NDArray[np.int64]]:
        """Points (n, 3) of the world at pixels (n, 2) of frame k, and the walls (n,) that they are on."""
        x = (pixel - [CAMERA.cu, CAMERA.cv]) / [CAMERA.fu, CAMERA.fv]
        pose = self.world_T_imu[k] @ IMU_T_CAM
        origin = pose[:3, 3] + pose[:3, 0] * CAMERA.baseline * right
        ray = np.hstack([x, np.ones((len(x), 1))]) @ pose[:3, :3].T
        away = []
        for normal, distance in WALLS:
            along = ray @ normal
            away.append(
                np.where(along > 1e-9, (distance - origin @ normal) / np.where(along > 1e-9, along, 1.0), np.inf)
            )
        wall = np.argmin(away, axis=0)
        return origin + ray * np.min(away, axis=0)[:, None], wall

    def project(self, k: int, points: FloatArray) -> FloatArray:
        """Pixels (n, 4) of points (n, 3) of the world in frame k."""
        return CAMERA.project(se3.transform(se3.inverse(self.world_T_imu[k] @ IMU_T_CAM), points))

    def image(self, k: int, *, right: bool = False) -> NDArray[np.uint8]:
        u, v = np.meshgrid(np.arange(WIDTH, dtype=np.float64), np.arange(HEIGHT, dtype=np.float64))
        points, wall = self.points(k, np.stack([u.ravel(), v.ravel()], axis=1), right)
        image = np.zeros(WIDTH * HEIGHT, np.float32)
        for i, (normal, _) in enumerate(WALLS):
            here = wall == i
            plane = np.delete(points[here], int(np.argmax(np.abs(normal))), axis=1) * TEXELS
            image[here] = map_coordinates(self.textures[i], plane.T, order=3, mode="grid-wrap")
        noise = np.random.default_rng((self.seed, k, right)).normal(0.0, 1.0, image.shape)
        return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8).reshape(HEIGHT, WIDTH)

    def write_euroc(self, folder: Path) -> Path:
        """A EuRoC folder with images, inertial samples and truth."""
        import cv2

        mav = folder / "mav0"
        for i in (0, 1):
            place = mav / f"cam{i}"
            (place / "data").mkdir(parents=True)
            for k, stamp in enumerate(self.stamps):
                cv2.imwrite(str(place / "data" / f"{stamp}.png"), self.image(k, right=bool(i)))
            lines = [f"{stamp},{stamp}.png" for stamp in self.stamps]
            (place / "data.csv").write_text("\n".join(["#timestamp [ns],filename", *lines, ""]))
            (place / "sensor.yaml").write_text(sensor_yaml(displaced(i)))
        self._write_imu(mav / "imu0")
        truth = mav / "state_groundtruth_estimate0"
        truth.mkdir()
        rows = ["#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"]
        for stamp, pose in zip(self.stamps, self.world_T_imu, strict=True):
            x, y, z, w = so3.quaternion_xyzw(pose[:3, :3]).tolist()
            rows.append(",".join(map(repr, [stamp, *pose[:3, 3].tolist(), w, x, y, z])))
        (truth / "data.csv").write_text("\n".join([*rows, ""]))
        return folder

    def _write_imu(self, folder: Path) -> None:
        folder.mkdir()
        stamps, samples = self.imu()
        lines = [",".join(map(repr, [stamp, *row])) for stamp, row in zip(stamps, samples.tolist(), strict=True)]
        (folder / "data.csv").write_text("\n".join([IMU_HEADER, *lines, ""]))
        (folder / "sensor.yaml").write_text(IMU_YAML)


IMU_HEADER = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y,w_RS_S_z,a_RS_S_x [m s^-2],a_RS_S_y,a_RS_S_z"
IMU_YAML = """%YAML:1.0
gyroscope_noise_density: 1.0e-3
gyroscope_random_walk: 1.0e-5
accelerometer_noise_density: 2.0e-2
accelerometer_random_walk: 1.0e-3
"""


def displaced(i: int) -> FloatArray:
    """`imu_T_cam` of the left (0) or right (1) camera."""
    motion = np.eye(4)
    motion[0, 3] = i * CAMERA.baseline
    return np.asarray(IMU_T_CAM @ motion)


def sensor_yaml(imu_T_cam: FloatArray) -> str:
    """EuRoC's `sensor.yaml` of an ideal camera."""
    return f"""%YAML:1.0
sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: {imu_T_cam.ravel().tolist()}
rate_hz: {RATE}
resolution: [{WIDTH}, {HEIGHT}]
camera_model: pinhole
intrinsics: [{CAMERA.fu}, {CAMERA.fv}, {CAMERA.cu}, {CAMERA.cv}]
distortion_model: radial-tangential
distortion_coefficients: [0.0, 0.0, 0.0, 0.0]
"""


def camchain_yaml(shift: float = 0.0, *, imu: bool = True, model: str = "radtan") -> str:
    """Kalibr's chain of the rig."""
    left = f"  T_cam_imu: {se3.inverse(IMU_T_CAM).tolist()}\n  timeshift_cam_imu: {shift}\n" if imu else ""
    right = np.eye(4)
    right[0, 3] = -CAMERA.baseline
    camera = f"""  camera_model: pinhole
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  distortion_model: {model}
  intrinsics: [{CAMERA.fu}, {CAMERA.fv}, {CAMERA.cu}, {CAMERA.cv}]
  resolution: [{WIDTH}, {HEIGHT}]
"""
    return f"cam0:\n{left}{camera}cam1:\n  T_cn_cnm1: {right.tolist()}\n{camera}"
