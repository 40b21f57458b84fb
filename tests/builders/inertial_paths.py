"""Recordings with raw inertial samples along any smooth path, with their truth and noise as stated."""

from collections.abc import Callable

import numpy as np

from fgbaseline import data
from fgbaseline.data.imu import STANDARD_GRAVITY, ImuNoise, ImuSamples
from fgbaseline.geometry import FloatArray, StereoCamera, se3, so3

from .inertial import IMU_T_CAM

CAMERA = StereoCamera(500.0, 500.0, 500.0, 250.0, 0.3)
NOISE = ImuNoise(1e-3, 1e-5, 1e-2, 1e-4)
BIAS_SIGMA = np.repeat([0.03, 0.2], 3)
STEP = 1e-4
PIXEL = 0.5
LEAD = 0.5
"""s of samples before frame 0"""
Path = Callable[[FloatArray], FloatArray]
"""world_T_imu (n, 4, 4) at times (n,) s, in a world whose z axis points up"""


def at_rest(t: FloatArray) -> FloatArray:
    """Standing, tilted, in vibration: 0.06 rad/s about each axis, as EuRoC's V1_01 has it."""
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    rate = 2.0 * np.pi * np.array([31.0, 37.0, 43.0])
    shaken = 0.085 / rate * np.sin(rate * t[:, None])
    poses[:, :3, :3] = so3.exp_so3(np.array([0.2, -0.1, 0.3])) @ so3.exp_so3(shaken)
    return poses


def trembling(t: FloatArray) -> FloatArray:
    """Standing, with rotations of a ten-thousandth of a radian: some hundredths of a pixel between frames."""
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    wave = np.sin(2.0 * np.pi * np.array([4.0, 5.0, 6.0]) * t[:, None])
    poses[:, :3, :3] = so3.exp_so3(np.array([0.2, -0.1, 0.3])) @ so3.exp_so3(1e-4 * wave)
    return poses


def straight(t: FloatArray) -> FloatArray:
    """A car at 25 m/s that brakes a little and rolls."""
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, 0, 3] = 25.0 * t - 0.4 * t**2
    poses[:, 2, 3] = 0.02 * np.sin(5.0 * t)
    wave = np.stack([0.01 * np.sin(3.0 * t), 0.01 * np.sin(4.0 * t), 0.02 * np.sin(t)], axis=1)
    poses[:, :3, :3] = so3.exp_so3(wave)
    return poses


def turn(t: FloatArray) -> FloatArray:
    """A car that turns at 0.5 rad/s on a circle of 16 m."""
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    angle = 0.5 * t
    poses[:, :3, 3] = np.stack([16.0 * np.sin(angle), 16.0 * (1.0 - np.cos(angle)), 0.02 * np.sin(4.0 * t)], axis=1)
    heading = np.zeros((len(t), 3))
    heading[:, 2] = angle
    roll = np.zeros((len(t), 3))
    roll[:, 0] = 0.05 + 0.02 * np.sin(3.0 * t)
    poses[:, :3, :3] = so3.exp_so3(heading) @ so3.exp_so3(roll)
    return poses


def upside_down(t: FloatArray) -> FloatArray:
    """A drone on its back that sways."""
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    wave = np.stack([np.sin(1.3 * t), np.sin(1.7 * t + 1.0), np.sin(0.9 * t + 2.0)], axis=1)
    poses[:, :3, 3] = 0.8 * wave
    poses[:, :3, :3] = np.diag([1.0, -1.0, -1.0]) @ so3.exp_so3(0.15 * wave[:, ::-1])
    return poses


def inertial_recording(
    path: Path, seed: int = 0, n_frames: int = 30, rate: float = 10.0, imu_rate: float = 200.0, pixel: float = PIXEL
) -> data.Sequence:
    """The recording of a path: samples and pixels with the noise that is stated, biases drawn by `BIAS_SIGMA`."""
    rng = np.random.default_rng([seed, 7])
    t = np.arange(n_frames) / rate
    imu_t = np.arange(-round(LEAD * imu_rate), round(t[-1] * imu_rate) + 2) / imu_rate
    samples, bias = _samples(path, imu_t, rng, imu_rate)
    poses = path(t)
    observations, n_landmarks = _observations(poses, rng, pixel)
    at_frames = bias[np.searchsorted(imu_t, t - 1e-9)]
    velocity = (path(t + STEP)[:, :3, 3] - path(t - STEP)[:, :3, 3]) / (2.0 * STEP)
    up = np.array([0.0, 0.0, 1.0])
    truth = data.Truth(
        poses, velocity=velocity, gyroscope_bias=at_frames[:, :3], accelerometer_bias=at_frames[:, 3:], up=up
    )
    none = np.empty((0, 3))
    return data.Sequence(
        path.__name__, t, none, none, CAMERA, IMU_T_CAM, observations, n_landmarks, imu=samples, truth=truth
    )


def _samples(path: Path, t: FloatArray, rng: np.random.Generator, rate: float) -> tuple[ImuSamples, FloatArray]:
    before, now, after = (path(t + offset) for offset in (-STEP, 0.0, STEP))
    w = so3.log_so3(np.swapaxes(before[:, :3, :3], 1, 2) @ after[:, :3, :3]) / (2.0 * STEP)
    acceleration = (after - 2.0 * now + before)[:, :3, 3] / STEP**2 + [0.0, 0.0, STANDARD_GRAVITY]
    force = np.einsum("nji,nj->ni", now[:, :3, :3], acceleration)
    root = np.sqrt(rate)
    walk = np.repeat([NOISE.gyroscope_walk, NOISE.accelerometer_walk], 3) / root
    bias = rng.normal(size=6) * BIAS_SIGMA + np.cumsum(rng.normal(size=(len(t), 6)) * walk, axis=0)
    white = rng.normal(size=(len(t), 6)) * np.repeat([NOISE.gyroscope_density, NOISE.accelerometer_density], 3) * root
    return ImuSamples(t, w + bias[:, :3] + white[:, :3], force + bias[:, 3:] + white[:, 3:], noise=NOISE), bias


def _observations(poses: FloatArray, rng: np.random.Generator, sigma: float) -> tuple[data.Observations, int]:
    """Points drawn in the view of every fourth frame, 3 to 25 m deep; those seen in three frames and more."""
    drawn = []
    for pose in poses[::4]:
        z = rng.uniform(3.0, 25.0, 60)
        rows = rng.uniform([-0.9, -0.45], [0.9, 0.45], (60, 2)) * z[:, None]
        drawn.append(se3.transform(pose @ IMU_T_CAM, np.column_stack([rows, z])))
    points = np.concatenate(drawn)
    frame, landmark, pixel = [], [], []
    for k, pose in enumerate(poses):
        p = se3.transform(se3.inverse(pose @ IMU_T_CAM), points)
        front = p[:, 2] > 2.0
        z = np.where(front, p[:, 2], 1.0)
        u, v = CAMERA.fu * p[:, 0] / z + CAMERA.cu, CAMERA.fv * p[:, 1] / z + CAMERA.cv
        right = u - CAMERA.fu * CAMERA.baseline / z
        seen = np.flatnonzero(front & (z < 30.0) & (right > 0.0) & (u < 1000.0) & (v > 0.0) & (v < 500.0))
        exact = np.stack([u, v, right, v], axis=1)[seen]
        frame.append(np.full(len(seen), k))
        landmark.append(seen)
        pixel.append(exact + rng.normal(size=exact.shape) * sigma)
    chosen = data.Observations.sort(np.concatenate(frame), np.concatenate(landmark), np.concatenate(pixel))
    few = np.bincount(chosen.landmark, minlength=len(points)) < 3
    return chosen.select(~few[chosen.landmark]), len(points)
