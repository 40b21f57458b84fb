"""Settings of a simulated recording."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ..axis_conventions import IDENTITY, axes_matrix
from ..imu import STANDARD_GRAVITY
from ..sequence import Sequence
from .rig import HANDHELD, KITTI, Rig, rig_of

PathName = Literal["town", "loop", "highway", "handheld", "drone", "along"]
WorldName = Literal["street", "room"]
Cameras = Literal["stereo", "left"]
Interval = Literal["after", "before", "mean"]
Vector = tuple[float, float, float]

MAX_FRAMES = 1_000_000
MAX_TIME_OFFSET = 1.0
"""s; the path is known this far beyond both ends"""


@dataclass(frozen=True, eq=False, slots=True)
class Velocities:
    """A motion to follow: sample k moves frame k to k + 1, in the IMU's frame."""

    t: FloatArray
    """(T,) s, strictly rising"""
    linear: FloatArray
    """(T, 3) m/s"""
    angular: FloatArray
    """(T, 3) rad/s"""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedImu:
    """Raw inertial samples in place of body velocities; the defaults are an ADIS16448, as EuRoC has it.

    Raises InputError, naming setting and value, for what cannot be.
    """

    rate: float = 200.0
    """Hz"""
    gyroscope_density: float = 1.7e-4
    """rad/s/sqrt(Hz)"""
    gyroscope_walk: float = 2e-5
    """rad/s^2/sqrt(Hz)"""
    accelerometer_density: float = 2e-3
    """m/s^2/sqrt(Hz)"""
    accelerometer_walk: float = 3e-3
    """m/s^3/sqrt(Hz)"""
    accelerometer_bias: Vector = (0.0, 0.0, 0.0)
    """m/s^2 at the first sample, in recorded axes; that of the gyroscope is `Simulation.gyro_bias`"""
    gravity: float = STANDARD_GRAVITY
    """m/s^2"""

    def __post_init__(self) -> None:
        _require_range("imu.rate", self.rate, low=1.0, high=10_000.0)
        for name in ("gyroscope_density", "gyroscope_walk", "accelerometer_density", "accelerometer_walk"):
            _require_range(f"imu.{name}", getattr(self, name), low=0.0)
        _require_vector("imu.accelerometer_bias", self.accelerometer_bias)
        _require_range("imu.gravity", self.gravity, low=0.0, low_open=True)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Simulation:
    """Settings of `simulate`. Raises InputError, naming setting and value, for what cannot be.

    What is recorded of a true body velocity `v`, `w` (axes of `imu_T_cam`) is, with `A` the matrix of the axis setting,

        linear_velocity  = velocity_scale * A_linear^T v + noise
        angular_velocity = A_angular^T w + gyro_bias + noise

    so that `A (angular_velocity - gyro_bias)` repairs it: a diagnosis gives back `A` itself, and the bias in recorded
    axes (what the gyroscope reads at rest).
    """

    path: PathName = "town"
    along: Sequence | Velocities | None = None
    """recording or velocities to follow on the path `along`: taken as true, each constant until the next frame"""
    along_gyro_bias: Vector = (0.0, 0.0, 0.0)
    """rad/s, subtracted from the angular velocities of `along` first: a recorded bias would roll the street over"""
    duration: float | None = None
    """s; 60, or all of `along`"""
    frame_rate: float | None = None
    """frames a second; 10, or the stamps of `along`"""
    seed: int = 0
    world: WorldName | None = None
    """surroundings; by default a room for `handheld`, `drone` and speeds below 1.5 m/s, otherwise a street"""
    rig: Rig | None = None
    """camera and extrinsic; by default that of `along`, a small rig for `handheld` and `drone`, else KITTI's car"""

    cameras: Cameras = "stereo"
    """both cameras of the rig, or the left one alone, which needs `imu`"""
    standing: float = 0.0
    """duration of standstill before the motion, s"""
    imu: SimulatedImu | None = None
    """raw inertial samples in place of body velocities; their axes, scale, offset and gyroscope bias are those below"""

    sigma_linear: float = 0.1
    """m/s, noise of each component of a velocity sample, held over the interval"""
    sigma_angular: float = 0.01
    """rad/s, the same for the angular velocity"""
    gyro_bias: Vector = (0.0, 0.0, 0.0)
    """rad/s in recorded axes"""
    velocity_scale: float = 1.0
    """recorded over true linear velocity"""
    time_offset: float = 0.0
    """s: the velocity stamped t is that of the motion at t + time_offset"""
    velocity_of_interval: Interval = "after"
    """interval of velocity sample k: `after` moves frame k to k + 1 exactly; `before` moved k - 1 to k exactly; `mean`
    is the velocity at the instant of frame k, so that the mean of neighbors moves k to k + 1 to second order in dt"""
    linear_axes: str = IDENTITY
    """axis convention of the recorded linear velocity, such as `x,-y,-z`: see `axes_matrix`"""
    angular_axes: str = IDENTITY

    features_per_frame: float = 70.0
    """average number of points that are tracked at a time"""
    track_length: float = 14.0
    """median number of frames after which the tracker loses a point that stays in view"""
    nearest: float | None = None
    """m, depth below which a point is not tracked; 5 in a street, 0.5 in a room"""
    farthest: float | None = None
    """m, the largest depth at which a track begins; 200 in a street, 15 in a room"""
    returning_share: float = 0.0
    """share of the tracks that are lost and found again"""
    return_after: float = 1.0
    """s from the first sight of such a track to its second; the time of a lap gives loop closures"""
    blackouts: tuple[tuple[float, float], ...] = ()
    """(start, end) in s: frames without features"""

    sigma_pixel: float = 0.5
    """px, noise of each of uL, vL, uR, vR"""
    row_correlation: float = 0.0
    """correlation of the noise of vL and vR; on real recordings vL - vR has a deviation of only 0.35 to 0.43 px"""
    wrong_share: float = 0.03
    """share of the observations that are wrong matches; half of them single, half from one frame on to the track's
    end"""
    bursts: tuple[tuple[float, float, float], ...] = ()
    """(start, end, share) in s: between them this share of the observations is wrong"""
    moving_share: float = 0.0
    """observations of moving objects as a share of all, in addition to `features_per_frame`"""

    def __post_init__(self) -> None:
        _require_choice("path", self.path, get_args(PathName))
        _require_choice("velocity_of_interval", self.velocity_of_interval, get_args(Interval))
        _require_choice("cameras", self.cameras, get_args(Cameras))
        if self.cameras == "left" and self.imu is None:
            raise InputError("cameras: one camera needs raw inertial samples, which bring the scale; give imu as well")
        if self.world is not None:
            _require_choice("world", self.world, get_args(WorldName))
        if (self.along is None) == (self.path == "along"):
            raise InputError(f"path and along: path 'along' needs velocities to follow, '{self.path}' takes none")
        _require_range("standing", self.standing, low=0.0, high=1e5)
        _require_range("duration", self.duration, low=0.0, low_open=True, high=1e5)
        _require_range("frame_rate", self.frame_rate, low=0.1, high=1000.0)
        frames = round(self.seconds * self.rate)
        if self.along is None and not 2 <= frames <= MAX_FRAMES:
            raise InputError(
                f"duration: {self.seconds:g} s at {self.rate:g} Hz are {frames} frames, expected 2 to {MAX_FRAMES}"
            )
        if not isinstance(self.seed, int | np.integer) or self.seed < 0:
            raise InputError(f"seed: expected a whole number from 0 on, got {self.seed!r}")
        for name in ("sigma_linear", "sigma_angular", "sigma_pixel"):
            _require_range(name, getattr(self, name), low=0.0)
        for name in ("wrong_share", "returning_share", "row_correlation"):
            _require_range(name, getattr(self, name), low=0.0, high=1.0)
        _require_range("moving_share", self.moving_share, low=0.0, high=0.9)
        _require_vector("gyro_bias", self.gyro_bias)
        _require_vector("along_gyro_bias", self.along_gyro_bias)
        _require_range("velocity_scale", self.velocity_scale, low=0.0, low_open=True)
        _require_range("time_offset", self.time_offset, low=-MAX_TIME_OFFSET, high=MAX_TIME_OFFSET)
        _require_range("features_per_frame", self.features_per_frame, low=0.0, high=5000.0)
        _require_range("track_length", self.track_length, low=3.0, high=1000.0)
        _require_range("return_after", self.return_after, low=0.0)
        _require_range("nearest", self.nearest, low=0.0, low_open=True)
        low, high = self.depths
        _require_range("farthest", high, low=low, low_open=True)
        for name in ("linear_axes", "angular_axes"):
            try:
                axes_matrix(getattr(self, name))
            except InputError as error:
                raise InputError(f"{name}: {error}") from None
        for blackout in self.blackouts:
            _require_interval("blackouts", blackout, size=2)
        for burst in self.bursts:
            _require_interval("bursts", burst, size=3)
            _require_range("bursts", burst[2], low=0.0, high=1.0)

    @property
    def seconds(self) -> float:
        """`duration`, or its default of 60."""
        return 60.0 if self.duration is None else self.duration

    @property
    def rate(self) -> float:
        """`frame_rate`, or its default of 10."""
        return 10.0 if self.frame_rate is None else self.frame_rate

    @property
    def scene(self) -> WorldName:
        """`world`, or its default."""
        if self.world is not None:
            return self.world
        linear = self.along.linear_velocity if isinstance(self.along, Sequence) else getattr(self.along, "linear", None)
        slow = linear is not None and bool(np.mean(np.linalg.norm(linear, axis=-1)) < 1.5)
        return "room" if slow or self.path in ("handheld", "drone") else "street"

    @property
    def mount(self) -> Rig:
        """`rig`, or its default."""
        if self.rig is not None:
            return self.rig
        if isinstance(self.along, Sequence):
            return rig_of(self.along)
        return HANDHELD if self.path in ("handheld", "drone") else KITTI

    @property
    def depths(self) -> tuple[float, float]:
        """`nearest` and `farthest`, or their defaults, m."""
        near, far = (0.5, 15.0) if self.scene == "room" else (5.0, 200.0)
        return self.nearest or near, self.farthest or far


def default_drive() -> Simulation:
    """Default recording of `fgbaseline run`: a minute of a car in a town."""
    return Simulation()


def _require_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InputError(f"{name}: expected one of {', '.join(choices)}, got {value!r}")


def _require_range(name: str, value: float | None, low: float, high: float = math.inf, low_open: bool = False) -> None:
    if value is None:
        return
    number = isinstance(value, int | float | np.number) and math.isfinite(value)
    if not number or not (low < value if low_open else low <= value) or value > high:
        bound = f"{'above' if low_open else 'at least'} {low:g}" + (f" and at most {high:g}" if high < math.inf else "")
        raise InputError(f"{name}: expected a number {bound}, got {value!r}")


def _require_vector(name: str, value: Vector) -> None:
    if not _numbers(value, size=3):
        raise InputError(f"{name}: expected three finite numbers, got {value!r}")


def _require_interval(name: str, value: tuple[float, ...], size: int) -> None:
    if not _numbers(value, size) or value[0] > value[1]:
        what = "(start, end)" if size == 2 else "(start, end, share)"
        raise InputError(f"{name}: expected {what} with the start before the end, in s, got {value!r}")


def _numbers(value: object, size: int) -> bool:
    if not isinstance(value, tuple | list | np.ndarray) or len(value) != size:
        return False
    return all(isinstance(number, int | float | np.number) and math.isfinite(number) for number in value)
