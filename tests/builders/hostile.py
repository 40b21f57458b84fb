"""Recordings that no estimator was made for, with known truth, and what is asked of every estimator on them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fgbaseline import data, diagnosis
from fgbaseline.compare.estimate_comparison import Result, Run, compare_all
from fgbaseline.data import Observations, Sequence, Truth
from fgbaseline.data.estimators.runner import solve_all
from fgbaseline.data.observations import BoolArray
from fgbaseline.data.simulate import KITTI, Simulation, simulate
from fgbaseline.geometry import FloatArray, se3

from .synthetic import Scene, drive, with_pixels

IMAGE = np.array([KITTI.width, KITTI.height, KITTI.width, KITTI.height])
PIXEL = 0.5
"""px, noise of the observations made here"""
HALF = 30
"""frame at which something happens, of 60"""
CROWD, CROWD_FRAMES = 2000, 3


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
    """Fifty meters of the drive are cut out, and the stamps do not show it."""
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
    """Two thousand more tracks over three frames."""
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


POSE_DEGREES = 6
ESTIMATORS = ("dead-reckoning", "ekf", "joint-ekf", "isam2", "isam2-online", "batch", "fixed-lag")
ADMITS = 3.5
"""sigmas, root mean square over frames and degrees of freedom: an answer that is no further off admits its errors"""


class Cell(StrEnum):
    """What an estimator made of a recording."""

    ADMITS = "admits"
    OVERCONFIDENT = "overconfident"
    FAILED = "failed"


@dataclass(frozen=True, eq=False)
class Hostile:
    """A recording, and which estimators are known to claim more than they know on it."""

    name: str
    make: Callable[[], Sequence]
    overconfident: tuple[str, ...] = ("ekf",)
    """`ekf` keeps no covariance between pose and landmarks, so it is on every drive that goes well"""
    fails: tuple[str, ...] = ()
    note: str = ""


BLIND = tuple(name for name in ESTIMATORS if name != "dead-reckoning")
RECORDINGS = (
    Hostile("nothing is wrong", base),
    Hostile("every observation wrong from half of it on", wrong_from_half, note="the mask excludes them"),
    Hostile("no features for 5 s", blind),
    Hostile("a standing start of 3 s", standing_start),
    Hostile("all landmarks behind the camera", behind, overconfident=(), fails=BLIND, note="no observation is left"),
    Hostile("all landmarks at infinity", at_infinity, overconfident=()),
    Hostile("zero and negative disparities only", no_positive_disparity, overconfident=(), fails=BLIND),
    Hostile("a gap of 10 s", gap, note="the noise allows for changes of the velocity in the gap"),
    Hostile(
        "50 m cut out, stamps as if nothing was",
        cut,
        overconfident=ESTIMATORS,
        note="only the end of all tracks at once shows it; diagnosis and trust report that",
    ),
    Hostile(
        "one velocity sample of 500 m/s",
        velocity_jump,
        note="the diagnosis finds the sample and interpolates its neighbors",
    ),
    Hostile("one landmark only", one_landmark, overconfident=()),
    Hostile(
        "2000 features in a frame",
        crowd,
        note="over three frames; `joint-ekf` initializes 512 of them and reports the rest",
    ),
)


def solved(recording: Hostile) -> Run:
    """Every estimator on the problem that `fgbaseline run` makes of it, compared."""
    problem = diagnosis.calibrated(recording.make())
    return compare_all(problem, solve_all(problem, ESTIMATORS), {})


def sigmas(result: Result) -> float:
    """How many of its own sigmas an answer is off: root of the mean NEES per degree of freedom."""
    assert result.nees is not None
    return float(np.sqrt(np.nanmean(result.nees) / POSE_DEGREES))


def error(result: Result) -> float:
    """The largest error in position, m."""
    assert result.truth is not None
    return float(result.truth["position"].max())


def cell(result: Result) -> Cell:
    """What the estimator made of it."""
    if not result.answered:
        return Cell.FAILED
    return Cell.ADMITS if sigmas(result) <= ADMITS else Cell.OVERCONFIDENT


def nan_velocity() -> dict[str, Any]:
    """The arrays of a file with NaN in one velocity sample."""
    arrays = recorded(base())
    arrays["linear_velocity"][1, 33] = np.nan
    return arrays


def falling_stamps() -> dict[str, Any]:
    """The arrays of a file in which a frame has a stamp before that of the frame before it."""
    arrays = recorded(base())
    arrays["time_stamps"][0, 41] = arrays["time_stamps"][0, 39]
    return arrays


def recorded(sequence: Sequence) -> dict[str, Any]:
    """The arrays that the file of a recording has."""
    with TemporaryDirectory() as folder:
        data.write_npz(sequence, Path(folder) / "a.npz")
        with np.load(Path(folder) / "a.npz") as arrays:
            return {key: arrays[key] for key in arrays.files}


REFUSED = {
    "NaN in one velocity sample": (nan_velocity, "linear_velocity: frame 33 has"),
    "falling stamps": (falling_stamps, "time_stamps: stamps must rise, but frame 41"),
}
