"""Recordings that no estimator was made for, with known truth, and what is asked of every estimator on them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fgbaseline.data import Observations, Sequence, Truth
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.simulate import KITTI, Simulation, simulate
from fgbaseline.geometry import FloatArray, se3

from .synthetic import Scene, drive, with_pixels

IMAGE = np.array([KITTI.width, KITTI.height, KITTI.width, KITTI.height])
PIXEL = 0.5
"""px, noise of the observations made here"""
HALF = 30
"""frame at which something happens, of 60"""
CROWD, CROWD_FRAMES = 2000, 6


def base() -> Sequence:
    """Six seconds of a town, nothing wrong with them."""
    return drive("town", seconds=6.0, features_per_frame=15.0)


def wrong_from_half() -> Sequence:
    """From frame 30 on every observation lies anywhere in the image."""
    sequence = base()
    random = np.random.default_rng(0)
    pixel = sequence.observations.pixel.copy()
    late = sequence.observations.frame >= HALF
    pixel[late] = random.uniform(0.0, 1.0, (int(late.sum()), 4)) * IMAGE
    return with_pixels(sequence, pixel)


def blind() -> Sequence:
    """No features between 2 and 7 s."""
    return simulate(Simulation(duration=9.0, features_per_frame=15.0, seed=1, wrong_share=0.0, blackouts=((2.0, 7.0),)))


def standing_start() -> Sequence:
    """Three seconds at the first pose before the drive begins."""
    sequence, n = base(), 30
    assert sequence.truth is not None
    random = np.random.default_rng(0)
    o = sequence.observations
    first = o.select(o.frame == 0)
    still = np.concatenate([np.full(n, 0.1), sequence.dt])
    noise = np.repeat([0.1, 0.01], 3) * random.normal(size=(n, 6))
    pixel = np.tile(first.pixel, (n, 1))
    return replace(
        sequence,
        t=np.concatenate([[0.0], np.cumsum(still)]),
        linear_velocity=np.concatenate([noise[:, :3], sequence.linear_velocity]),
        angular_velocity=np.concatenate([noise[:, 3:], sequence.angular_velocity]),
        observations=Observations(
            np.concatenate([np.repeat(np.arange(n), len(first)), o.frame + n]),
            np.concatenate([np.tile(first.landmark, n), o.landmark]),
            np.concatenate([pixel + PIXEL * random.normal(size=pixel.shape), o.pixel]),
        ),
        truth=replace(
            sequence.truth, world_T_imu=np.concatenate([np.tile(np.eye(4), (n, 1, 1)), sequence.truth.world_T_imu])
        ),
    )


def _with_disparities(disparity: Callable[[int, np.random.Generator], FloatArray]) -> Sequence:
    sequence = base()
    random = np.random.default_rng(0)
    pixel = sequence.observations.pixel.copy()
    pixel[:, 2] = pixel[:, 0] - disparity(len(pixel), random)
    return with_pixels(sequence, pixel)


def at_infinity() -> Sequence:
    """Every disparity is zero but for noise."""
    return _with_disparities(lambda n, random: PIXEL * np.sqrt(2.0) * random.normal(size=n))


def no_positive_disparity() -> Sequence:
    """Every disparity is zero or negative."""
    return _with_disparities(lambda n, random: -np.round(random.uniform(0.0, 20.0, n) * (random.random(n) < 0.5)))


def behind() -> Sequence:
    """Every pixel is that of the point mirrored in the camera: what a tracker with exchanged cameras gives."""
    sequence = base()
    pixel = sequence.observations.pixel
    return with_pixels(sequence, pixel[:, [2, 3, 0, 1]])


def kept_frames(sequence: Sequence, kept: BoolArray, t: FloatArray) -> Sequence:
    """The recording of the frames that are kept, stamped anew."""
    assert sequence.truth is not None
    o = sequence.observations
    chosen = o.select(kept[o.frame])
    return replace(
        sequence,
        t=t,
        linear_velocity=sequence.linear_velocity[kept],
        angular_velocity=sequence.angular_velocity[kept],
        observations=Observations((np.cumsum(kept) - 1)[chosen.frame], chosen.landmark.copy(), chosen.pixel.copy()),
        truth=replace(sequence.truth, world_T_imu=sequence.truth.world_T_imu[kept]),
    )


def gap() -> Sequence:
    """Ten seconds without frames, stamps and velocities; the drive goes on meanwhile."""
    sequence = drive("town", seconds=16.0, features_per_frame=15.0)
    kept = (np.arange(160) < HALF) | (np.arange(160) >= HALF + 100)
    return kept_frames(sequence, kept, sequence.t[kept])


def cut() -> Sequence:
    """Fifty metres of the drive are cut out, and the stamps do not show it."""
    sequence = drive("town", seconds=16.0, features_per_frame=15.0)
    assert sequence.truth is not None
    x = sequence.truth.world_T_imu[:, :3, 3]
    resumed = HALF + int(np.argmax(np.linalg.norm(x[HALF:] - x[HALF], axis=1) >= 50.0))
    kept = (np.arange(160) <= HALF) | ((np.arange(160) > resumed) & (np.arange(160) < resumed + HALF))
    return kept_frames(sequence, kept, sequence.t[: int(kept.sum())].copy())


def velocity_jump() -> Sequence:
    """One velocity sample says 500 m/s: the odometry jumps by 50 m, the car does not."""
    sequence = base()
    linear = sequence.linear_velocity.copy()
    linear[HALF, 0] = 500.0
    return replace(sequence, linear_velocity=linear)


def one_landmark() -> Sequence:
    """One point, seen by all of 40 frames."""
    return Scene(frames=40, n_points=1).sequence()


def crowd() -> Sequence:
    """Two thousand more tracks over six frames."""
    sequence = base()
    assert sequence.truth is not None
    assert sequence.truth.landmarks is not None
    random = np.random.default_rng(0)
    frames = np.arange(HALF, HALF + CROWD_FRAMES)
    cameras = sequence.truth.world_T_imu[frames] @ sequence.imu_T_cam
    depth = random.uniform(15.0, 60.0, CROWD)
    points = se3.transform(
        cameras[-1],
        np.column_stack([random.uniform(-0.4, 0.4, CROWD), random.uniform(-0.1, 0.1, CROWD), np.ones(CROWD)])
        * depth[:, None],
    )
    frame, number = np.divmod(np.arange(CROWD_FRAMES * CROWD), CROWD)
    exact = sequence.camera.project(se3.transform(se3.inverse(cameras)[frame], points[number]))
    o, m = sequence.observations, sequence.n_landmarks
    return replace(
        sequence,
        n_landmarks=m + CROWD,
        observations=Observations.sort(
            np.concatenate([o.frame, frames[frame]]),
            np.concatenate([o.landmark, m + number]),
            np.concatenate([o.pixel, exact + PIXEL * random.normal(size=exact.shape)]),
        ),
        truth=Truth(
            sequence.truth.world_T_imu.copy(), np.concatenate([sequence.truth.landmarks, points]), sequence.truth.source
        ),
    )
