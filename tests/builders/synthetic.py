"""Small recordings and problems with known truth, for tests."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from fgbaseline import diagnosis
from fgbaseline.data import Estimate, Excluded, HuberKernel, Observations, Problem, Sequence, Truth
from fgbaseline.data.simulate import KITTI, Simulation, simulate
from fgbaseline.data.simulate.settings import PathName
from fgbaseline.data.velocity_increments import Shift, dead_reckoned_path, increments
from fgbaseline.ekf.pose_update import PoseInnovation, pose_innovation
from fgbaseline.geometry import FloatArray, MeasurementModel, se3

DT = 0.1


@cache
def drive(
    path: PathName = "town", seconds: float = 5.0, features_per_frame: float = 8.0, seed: int = 1, wrong: float = 0.0
) -> Sequence:
    """A simulated drive with consistent axes and, by default, no wrong matches."""
    return simulate(
        Simulation(path=path, duration=seconds, features_per_frame=features_per_frame, seed=seed, wrong_share=wrong)
    )


@dataclass(frozen=True)
class Scene:
    """A gentle curve of T frames past `n_points` points that every frame sees, ahead of the last one."""

    frames: int = 10
    n_points: int = 12
    sigma_pixel: float = 0.5
    seed: int = 0
    velocity: tuple[float, ...] = (6.0, 0.3, 0.0, 0.02, -0.03, 0.15)
    """[v, w] m/s, rad/s"""
    sigma_velocity: tuple[float, float] = (0.1, 0.01)
    """m/s, rad/s: noise of the recorded velocities"""

    def sequence(self) -> Sequence:
        """The recording, with its truth."""
        random = np.random.default_rng(self.seed)
        u = np.tile(self.velocity, (self.frames, 1)) + np.repeat([0.1, 0.01], 3) * random.normal(size=(self.frames, 6))
        path = dead_reckoned_path(u[:-1] * DT)
        cameras = path @ KITTI.imu_T_cam
        depth = random.uniform(8.0, 30.0, self.n_points)
        sideways = random.uniform(-0.5, 0.5, (self.n_points, 2)) * [1.0, 0.3] * depth[:, None]
        points = se3.transform(cameras[-1], np.column_stack([sideways, depth]))
        frame, landmark = np.divmod(np.arange(self.frames * self.n_points), self.n_points)
        exact = KITTI.camera.project(se3.transform(se3.inverse(cameras)[frame], points[landmark]))
        noise = np.repeat(self.sigma_velocity, 3) * random.normal(size=u.shape)
        recorded = u + noise
        return Sequence(
            name="scene",
            t=DT * np.arange(self.frames),
            linear_velocity=recorded[:, :3],
            angular_velocity=recorded[:, 3:],
            camera=KITTI.camera,
            imu_T_cam=KITTI.imu_T_cam.copy(),
            observations=Observations(frame, landmark, exact + self.sigma_pixel * random.normal(size=exact.shape)),
            n_landmarks=self.n_points,
            truth=Truth(path, points, "the scene"),
        )


def first_frames(s: Sequence, frames: int) -> Sequence:
    """The recording of the first frames alone."""
    o, truth = s.observations, s.truth
    return replace(
        s,
        t=s.t[:frames].copy(),
        linear_velocity=s.linear_velocity[:frames].copy(),
        angular_velocity=s.angular_velocity[:frames].copy(),
        observations=o.select(o.frame < frames),
        truth=None if truth is None else replace(truth, world_T_imu=truth.world_T_imu[:frames]),
    )


def with_pixels(sequence: Sequence, pixel: FloatArray) -> Sequence:
    """The recording with other pixels (n, 4)."""
    o = sequence.observations
    return replace(sequence, observations=Observations(o.frame.copy(), o.landmark.copy(), pixel))


def first_innovation(sequence: Sequence, world_T_imu: FloatArray) -> PoseInnovation:
    """That of all that frame 0 of a `Scene` sees, at a pose (4, 4), the landmarks being known."""
    assert sequence.truth is not None
    assert sequence.truth.landmarks is not None
    points, pixel = sequence.truth.landmarks, sequence.observations.pixel[: sequence.n_landmarks]
    model = MeasurementModel(sequence.camera, 0.25)
    return pose_innovation(model, se3.inverse(sequence.imu_T_cam), world_T_imu, points, pixel)


def plain_problem(sequence: Sequence, kernel: HuberKernel | None = None, pixel_sigma: float = 0.5) -> Problem:
    """Every observation, noise as in `Scene`, no prior on landmarks, and the first pose known to 1 cm and 1 mrad."""
    step = increments(sequence)
    variance = (np.repeat([0.1, 0.01], 3) * DT) ** 2
    return Problem(
        preset="plain",
        sequence=sequence,
        increment=step,
        increment_covariance=np.broadcast_to(np.diag(variance), (len(step), 6, 6)),
        pixel_variance=pixel_sigma**2,
        features=np.arange(sequence.n_landmarks),
        excluded=np.full(len(sequence.observations), Excluded.NO, dtype=np.uint8),
        initial_pose=np.eye(4),
        initial_covariance=np.diag(np.repeat([1e-4, 1e-6], 3)),
        kernel=kernel,
    )


def matched(sequence: Sequence) -> Problem:
    """The calibrated preset with the noise that `drive` simulates: 0.5 px, 0.1 m/s, 0.01 rad/s, held over the interval
    after the sample."""
    noise = diagnosis.NoiseSettings(pixel=0.5, linear_velocity=0.1, angular_velocity=0.01)
    return diagnosis.calibrated(sequence, settings=diagnosis.AsRecordedSettings(noise=noise, shift=Shift.AFTER))


def position_errors(estimate: Estimate, sequence: Sequence) -> FloatArray:
    """(T,) m, distances from the recording's true positions."""
    assert sequence.truth is not None
    difference = estimate.world_T_imu[:, :3, 3] - sequence.truth.world_T_imu[:, :3, 3]
    return np.asarray(np.linalg.norm(difference, axis=1))
