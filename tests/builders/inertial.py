"""Inertial problems with known truth: a smooth closed-form motion among random landmarks, and simulated recordings."""

from dataclasses import replace

import numpy as np

from fgbaseline import data
from fgbaseline.data.estimators.estimate import Estimate
from fgbaseline.data.imu import ImuNoise, ImuSamples
from fgbaseline.data.problem import InverseDepthPrior, Problem
from fgbaseline.data.problem.inertial import InertialStart, imu_intervals
from fgbaseline.data.simulate import SimulatedImu, Simulation, simulate
from fgbaseline.data.simulate.settings import Cameras, PathName
from fgbaseline.geometry import FloatArray, HuberKernel, StereoCamera, se3, so3, strapdown

CAMERA = StereoCamera(450.0, 450.0, 320.0, 240.0, 0.12)
IMU_T_CAM = se3.exp([0.05, 0.02, -0.01, 0.0, 0.0, 0.0])
IMU_T_CAM[:3, :3] = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
NOISE = ImuNoise(2e-3, 2e-5, 2e-2, 3e-3)
START_SIGMA = np.repeat([0.0, 0.01, 0.05, 2e-3, 2e-2], 3)
"""of the true start about the given one; heading and position are exact"""
ROOM_DEPTHS = InverseDepthPrior(0.2, 0.2)
"""1/m, of the points that simulated tracks begin at in a room"""
MIN_DISPARITY = 6.0
"""px, of the exact pixels"""
STEP = 1e-4
"""s, of the finite differences that give the true samples"""


def motion(t: FloatArray, seed: int) -> FloatArray:
    """Poses (n, 4, 4) of the IMU at times (n,), s: sums of sines with random phases."""
    rng = np.random.default_rng(seed)
    phase, rate = rng.uniform(0.0, 2.0 * np.pi, (6, 2)), rng.uniform(0.4, 1.6, (6, 2))
    size = np.array([[1.5, 0.5], [1.5, 0.5], [0.5, 0.3], [0.1, 0.1], [0.1, 0.1], [0.6, 0.3]])
    values = np.sum(size * np.sin(rate * t[:, None, None] + phase), axis=2)
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, :3, :3] = so3.exp_so3(values[:, 3:])
    poses[:, :3, 3] = values[:, :3]
    return poses


def inertial_problem(seed: int = 0, n_frames: int = 50, rate: float = 10.0, imu_rate: float = 100.0) -> Problem:
    """A problem with its truth in `sequence.truth`; pixels, samples, biases and start have the noise it states."""
    rng = np.random.default_rng([seed, 1])
    t, imu_t = np.arange(n_frames) / rate, np.arange(int(n_frames * imu_rate / rate) + 1) / imu_rate
    world_T_imu = motion(t, seed)
    around = [motion(imu_t + offset, seed) for offset in (-STEP, 0.0, STEP)]
    w = so3.log_so3(np.swapaxes(around[0][:, :3, :3], 1, 2) @ around[2][:, :3, :3]) / (2.0 * STEP)
    p = [poses[:, :3, 3] for poses in around]
    acceleration = (p[2] - 2.0 * p[1] + p[0]) / STEP**2 + [0.0, 0.0, data.imu.STANDARD_GRAVITY]
    force = np.einsum("nji,nj->ni", around[1][:, :3, :3], acceleration)
    root = np.sqrt(imu_rate)
    start_bias = rng.normal(size=6) * np.repeat([2e-2, 2e-1], 3)
    walk = np.repeat([NOISE.gyroscope_walk, NOISE.accelerometer_walk], 3) / root
    bias = start_bias + np.cumsum(rng.normal(size=(len(imu_t), 6)) * walk, axis=0)
    white = rng.normal(size=(len(imu_t), 6)) * np.repeat([NOISE.gyroscope_density, NOISE.accelerometer_density], 3)
    imu = ImuSamples(
        imu_t, w + bias[:, :3] + white[:, :3] * root, force + bias[:, 3:] + white[:, 3:] * root, noise=NOISE
    )
    observations, n_landmarks = _observations(world_T_imu, rng)
    velocity = (motion(t + STEP, seed)[:, :3, 3] - motion(t - STEP, seed)[:, :3, 3]) / (2.0 * STEP)
    at_frames = bias[np.searchsorted(imu_t, t - 1e-9)]
    truth = data.Truth(
        world_T_imu, velocity=velocity, gyroscope_bias=at_frames[:, :3], accelerometer_bias=at_frames[:, 3:]
    )
    none = np.empty((0, 3))
    sequence = data.Sequence(
        "inertial", t, none, none, CAMERA, IMU_T_CAM, observations, n_landmarks, imu=imu, truth=truth
    )
    return _problem(sequence, 1.0, rng)


def simulated_problem(path: PathName, seed: int, seconds: float = 10.0, cameras: Cameras = "stereo") -> Problem:
    """A simulated recording with 30 tracks a frame and random biases, at its true noise."""
    rng = np.random.default_rng([seed, 7])
    imu = SimulatedImu(accelerometer_bias=tuple(5e-2 * rng.normal(size=3)))
    gyro_bias = tuple(5e-3 * rng.normal(size=3))
    settings = Simulation(
        path=path,
        duration=seconds,
        features_per_frame=30.0,
        seed=seed,
        wrong_share=0.0,
        gyro_bias=gyro_bias,
        imu=imu,
        cameras=cameras,
    )
    return _problem(simulate(settings), settings.sigma_pixel**2, rng)


def _problem(sequence: data.Sequence, pixel_variance: float, rng: np.random.Generator) -> Problem:
    """All observations of the sequence, with a start drawn about its truth."""
    assert sequence.truth is not None
    assert sequence.imu is not None
    pose, start = _start(sequence.truth, rng)
    return Problem(
        preset="calibrated",
        sequence=sequence,
        increment=np.empty((0, 6)),
        increment_covariance=np.empty((0, 6, 6)),
        pixel_variance=pixel_variance,
        features=np.unique(sequence.observations.landmark),
        excluded=np.zeros(len(sequence.observations), np.uint8),
        initial_pose=pose,
        initial_covariance=np.zeros((6, 6)),
        imu=imu_intervals(sequence.imu, sequence.t),
        start=start,
        inverse_depth_prior=ROOM_DEPTHS if sequence.monocular else None,
        kernel=HuberKernel(),
    )


def _start(truth: data.Truth, rng: np.random.Generator) -> tuple[FloatArray, InertialStart]:
    """The true start with an error drawn from its covariance, which has nothing about the vertical."""
    assert truth.velocity is not None
    assert truth.gyroscope_bias is not None
    assert truth.accelerometer_bias is not None
    pose = truth.world_T_imu[0]
    covariance = np.diag(START_SIGMA**2)
    up = pose[2, :3]
    tilt = np.eye(3) - np.outer(up, up)
    covariance[strapdown.ROTATION, strapdown.ROTATION] = START_SIGMA[3] ** 2 * tilt
    error = rng.normal(size=15) * START_SIGMA
    error[strapdown.ROTATION] = tilt @ error[strapdown.ROTATION]
    return pose @ se3.exp(-error[:6]), InertialStart(
        truth.velocity[0] - error[6:9],
        truth.gyroscope_bias[0] - error[9:12],
        truth.accelerometer_bias[0] - error[12:],
        covariance,
    )


def _observations(world_T_imu: FloatArray, rng: np.random.Generator) -> tuple[data.Observations, int]:
    points = rng.uniform([-15.0, -15.0, -4.0], [15.0, 15.0, 4.0], (600, 3))
    world_T_cam = world_T_imu @ IMU_T_CAM
    frame, landmark, pixel = [], [], []
    for k, cam_T_world in enumerate(se3.inverse(world_T_cam)):
        p = se3.transform(cam_T_world, points)
        z = np.where(p[:, 2] > 0.5, p[:, 2], np.nan)
        u, v = CAMERA.fu * p[:, 0] / z + CAMERA.cu, CAMERA.fv * p[:, 1] / z + CAMERA.cv
        disparity = CAMERA.fu * CAMERA.baseline / z  # a choice by the noisy one would make points nearer than they are
        seen = np.flatnonzero((u > 60.0) & (u < 640.0) & (v > 0.0) & (v < 480.0) & (disparity > MIN_DISPARITY))
        exact = np.stack([u, v, u - disparity, v], axis=1)[seen]
        frame.append(np.full(len(seen), k))
        landmark.append(seen)
        pixel.append(exact + rng.normal(size=exact.shape))
    chosen = data.Observations.sort(np.concatenate(frame), np.concatenate(landmark), np.concatenate(pixel))
    few = np.bincount(chosen.landmark, minlength=len(points)) < 3
    return chosen.select(~few[chosen.landmark]), len(points)


def at_truth(problem: Problem) -> Problem:
    """The problem started at its truth, with hardly any variance."""
    truth, start = problem.sequence.truth, problem.start
    assert truth is not None
    assert start is not None
    assert truth.velocity is not None
    assert truth.gyroscope_bias is not None
    assert truth.accelerometer_bias is not None
    given = replace(
        start,
        velocity=truth.velocity[0],
        gyroscope_bias=truth.gyroscope_bias[0],
        accelerometer_bias=truth.accelerometer_bias[0],
        covariance=1e-12 * np.eye(15),
    )
    return replace(problem, initial_pose=truth.world_T_imu[0], start=given)


def state_errors(estimate: Estimate, problem: Problem) -> FloatArray:
    """(T, 15) errors of the states."""
    truth = problem.sequence.truth
    assert truth is not None
    names = ("velocity", "gyroscope_bias", "accelerometer_bias")
    pose = se3.log(se3.inverse(estimate.world_T_imu) @ truth.world_T_imu)
    return np.concatenate([pose, *(getattr(truth, name) - getattr(estimate, name) for name in names)], axis=1)
