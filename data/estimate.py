"""What every estimator answers."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Protocol

import numpy as np

from fgbaseline.geometry import FloatArray, se3, strapdown

from .observations import BoolArray, IntArray


class Progress(Protocol):
    """Told after every frame how many are done and how many there are."""

    def __call__(self, done: int, total: int, /) -> None:
        """`done` frames of `total` are estimated."""
        ...


class Status(StrEnum):
    """How an estimator ended."""

    OK = "ok"
    RECOVERED = "recovered"
    """it met trouble, gave something up (see its events), and finished"""
    FAILED = "failed"


class EventKind(StrEnum):
    """Kinds of events that the estimators of this package report; the values are the text in files and tables."""

    LANDMARK_DROPPED = "landmark dropped"
    """it violated cheirality or made the system indeterminate, and was removed from the graph"""
    LANDMARK_NEVER_DETERMINED = "landmark never determined"
    FRAME_WITHOUT_OBSERVATIONS = "frame without observations"
    """the observations of a frame left the system indeterminate and were removed; weighs on the reference's trust"""
    SOLVED_BY_QR = "solved by QR"
    RELINEARIZATION_FAILED = "final relinearisation failed"
    NO_COVARIANCES = "no covariances"
    DESCENT_FAILED = "descent failed"
    """Levenberg-Marquardt ended with an exception from one of its starts"""
    ONE_START = "one start only"
    """a minimum that no second start confirms; weighs on the reference's trust"""
    SAME_COST = "both starts end at the same cost"
    DIFFERENT_COSTS = "starts end at different costs"
    SINGULAR_INNOVATION = "innovation covariance singular"
    COVARIANCE_LOST = "covariance lost"
    """the covariance of a filter's state was no longer positive definite"""
    GYROSCOPE_BIAS = "gyroscope bias"
    """a result: the bias that was estimated along with the poses"""
    BEHIND_CAMERA = "behind the camera"
    """observations rejected since their landmark violates cheirality"""
    OUTSIDE_GATE = "outside the gate"
    """observations rejected by a chi-square gate"""
    FRAME_DISAGREES = "frame disagrees"
    """all observations of a frame rejected, since most of them are beyond a chi-square quantile"""
    INITIALIZATION_DEFERRED = "entry put off"
    """first observations of landmarks in a rejected frame, or at infinity in world coordinates"""
    STATE_FULL = "state full"
    """observations of landmarks that the state has no room for"""


@dataclass(frozen=True, slots=True)
class Event:
    """What happened in an estimator: where, what and why."""

    frame: int
    kind: EventKind | str
    """short and countable; any text of an estimator's own is counted and listed, and weighs on nothing"""
    reason: str
    landmark: int | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Landmarks:
    """m estimated landmarks, in the world frame."""

    index: IntArray
    """(m,) increasing indices of the sequence's landmarks"""
    position: FloatArray
    """(m, 3) m"""
    covariance: FloatArray | None = None
    """(m, 3, 3) m^2 in the world frame; NaN where the estimator cannot tell"""

    @staticmethod
    def none() -> "Landmarks":
        """No landmark."""
        return Landmarks(np.empty(0, np.int64), np.empty((0, 3)))

    def __len__(self) -> int:
        return len(self.index)


@dataclass(frozen=True, eq=False, slots=True)
class Innovations:
    """How large a filter's innovations were beside what it expected, frame by frame.

    Of everything that a frame offered to the pose update, before the kernel or any gate: what is rejected counts too.
    """

    nis: FloatArray
    """(T,) normalised innovation squared nu^T S^-1 nu over the three rows (uL, uR, (vL + vR) / 2) of all of a frame's
    observations of landmarks already known, S the filter's own covariance of nu; NaN where there is none"""
    degrees: IntArray
    """(T,) rows that this is over: 3 for each observation"""

    @staticmethod
    def none(n_frames: int) -> "Innovations":
        """Arrays to be filled in, no frame having any yet."""
        return Innovations(np.full(n_frames, np.nan), np.zeros(n_frames, dtype=np.int64))


@dataclass(frozen=True, eq=False, slots=True)
class GyroBias:
    """What a gyroscope reads at rest as an estimator knew it at each frame, in the axes of the IMU."""

    mean: FloatArray
    """(T, 3) rad/s, to be taken off the angular velocities of the problem's sequence"""
    covariance: FloatArray
    """(T, 3, 3)"""


@dataclass(frozen=True, eq=False, slots=True)
class Estimate:
    """The answer of one estimator to one problem: T frames, n observations in its sequence."""

    name: str
    world_T_imu: FloatArray
    """(T, 4, 4); all NaN from the frame on at which an estimator failed"""
    used: BoolArray
    """(n,) which of the sequence's observations took part"""
    covariance: FloatArray | None = None
    """(T, 6, 6) of the right perturbation [v, w] of each pose (m, rad); None where the estimator has none"""
    landmarks: Landmarks = field(default_factory=Landmarks.none)
    status: Status = Status.OK
    reason: str = ""
    """why the status is not ok, in a sentence"""
    seconds: FloatArray = field(default_factory=lambda: np.empty(0))
    """(T,) time spent on each frame, s"""
    seconds_total: float = 0.0
    """time for all of it, set-up and covariances included, s"""
    events: tuple[Event, ...] = ()
    innovations: Innovations | None = None
    """of a filter that records them"""
    gyro_bias: GyroBias | None = None
    """where it was estimated along with the poses"""
    velocity: FloatArray | None = None
    """(T, 3) m/s in world axes; estimated from raw inertial data, as are the two biases"""
    gyroscope_bias: FloatArray | None = None
    """(T, 3) rad/s"""
    accelerometer_bias: FloatArray | None = None
    """(T, 3) m/s^2"""
    state_covariance: FloatArray | None = None
    """(T, 15, 15) of the errors [translation, rotation, velocity, gyroscope bias, accelerometer bias]: right
    perturbation of the pose, additive otherwise; its first 6 x 6 block is `covariance`"""
    by_products: Mapping[str, "Estimate"] = field(default_factory=dict)
    """further answers that the same run gave at no cost, by the name they are registered under"""

    def transformed(self, motion: FloatArray) -> "Estimate":
        """The same answer in another world, `motion` (4, 4) being new_T_old: poses and landmarks, by-products too."""
        R, landmarks, state_covariance = motion[:3, :3], self.landmarks, self.state_covariance
        if state_covariance is not None:  # the velocity's error is in world axes
            turn = np.eye(strapdown.STATE)
            turn[strapdown.VELOCITY, strapdown.VELOCITY] = R
            state_covariance = turn @ state_covariance @ turn.T
        covariance = None if landmarks.covariance is None else R @ landmarks.covariance @ R.T
        return replace(
            self,
            world_T_imu=motion @ self.world_T_imu,
            landmarks=Landmarks(landmarks.index, se3.transform(motion, landmarks.position), covariance),
            velocity=None if self.velocity is None else self.velocity @ R.T,
            state_covariance=state_covariance,
            by_products={name: other.transformed(motion) for name, other in self.by_products.items()},
        )

    @staticmethod
    def failed(name: str, reason: str, n_frames: int, n_observations: int) -> "Estimate":
        """The answer of an estimator that has none."""
        return Estimate(
            name=name,
            world_T_imu=np.full((n_frames, 4, 4), np.nan),
            used=np.zeros(n_observations, dtype=np.bool_),
            status=Status.FAILED,
            reason=reason,
            seconds=np.zeros(n_frames),
        )
