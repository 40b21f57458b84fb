"""Estimate of one problem: trajectory, landmarks, covariances, status and events."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import nan
from typing import TYPE_CHECKING, Protocol

import numpy as np

from fgbaseline.geometry import FloatArray, se3, strapdown
from fgbaseline.geometry.path_length import path_length

from ..dataframes import axis_columns, plot_path, pose_columns, table
from ..display import Displayed
from ..observations import BoolArray, IntArray
from ..wording import plural

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


class Progress(Protocol):
    """Progress callback, called after every frame."""

    def __call__(self, done: int, total: int, /) -> None:
        """`done` frames of `total` are estimated."""
        ...


class Status(StrEnum):
    """Outcome of an estimator."""

    OK = "ok"
    RECOVERED = "recovered"
    """finished after dropping a frame or landmarks, or with an invalid covariance (see its events)"""
    FAILED = "failed"


class EventKind(StrEnum):
    """Kinds of events of the estimators of this package; the values are the texts in files and tables."""

    LANDMARK_DROPPED = "landmark dropped"
    """landmark removed from the graph, since it violated cheirality or made the system indeterminate"""
    LANDMARK_NEVER_DETERMINED = "landmark never determined"
    FRAME_WITHOUT_OBSERVATIONS = "frame without observations"
    """observations of a frame removed, since they left the system indeterminate; lowers the trust in the reference"""
    SOLVED_BY_QR = "solved by QR"
    RELINEARIZATION_FAILED = "final relinearization failed"
    NO_COVARIANCES = "no covariances"
    DESCENT_FAILED = "descent failed"
    """Levenberg-Marquardt from one of its initial values ended with an exception"""
    STARTED_AT_ISAM2 = "started at isam2's solution only"
    """batch solution from isam2's solution alone, as requested: it shows whether isam2 has converged"""
    ONE_START = "one start only"
    """minimum not confirmed by a second start; lowers the trust in the reference"""
    SAME_COST = "both starts end at the same cost"
    DIFFERENT_COSTS = "starts end at different costs"
    SINGULAR_INNOVATION = "innovation covariance singular"
    COVARIANCE_LOST = "covariance lost"
    """the covariance of a filter's state was no longer positive definite"""
    GYROSCOPE_BIAS = "estimated gyroscope bias"
    """estimate of the bias, if it is part of the state"""
    BEHIND_CAMERA = "behind the camera"
    """observations rejected because their landmark violates cheirality"""
    OUTSIDE_GATE = "outside the gate"
    """observations rejected by a chi-square gate"""
    FRAME_DISAGREES = "frame disagrees"
    """all observations of a frame rejected, because most of them exceed a chi-square quantile"""
    PROCESS_NOISE_INFLATED = "process noise inflated"
    """noise added to a filter's motion: successive frames disagree with it, though their observations agree"""
    INITIALIZATION_DEFERRED = "initialization deferred"
    """first observations of landmarks in a rejected frame, or at infinity in world coordinates"""
    STATE_FULL = "state full"
    """observations of landmarks that the state has no room for"""


@dataclass(frozen=True, slots=True)
class Event:
    """Event of an estimator: frame, kind and cause."""

    frame: int
    kind: EventKind | str
    """short and countable; kinds of other packages are counted and listed, without effect on the trust"""
    reason: str
    landmark: int | None = None


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Landmarks(Displayed):
    """m estimated landmarks, in the world frame."""

    index: IntArray
    """(m,) increasing indices of the sequence's landmarks"""
    position: FloatArray
    """(m, 3) m"""
    covariance: FloatArray | None = None
    """(m, 3, 3) m^2 in the world frame; NaN where unknown"""

    @staticmethod
    def none() -> "Landmarks":
        """Empty set of landmarks."""
        return Landmarks(np.empty(0, np.int64), np.empty((0, 3)))

    def __len__(self) -> int:
        return len(self.index)

    def to_frame(self) -> "pd.DataFrame":
        """Table of x, y, z (m) with a row for each landmark, by its index in the sequence."""
        return table({"landmark": self.index, **axis_columns("", self.position)}, "").set_index("landmark")


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Innovations(Displayed):
    """Normalized innovation squared (NIS) of a filter, by frame.

    Covers all observations offered to the pose update, before kernel and gate: rejected ones count too.
    """

    nis: FloatArray
    """(T,) nu^T S^-1 nu over the three rows (uL, uR, (vL + vR) / 2) of all observations of known landmarks in a frame,
    S being the filter's own covariance of nu; NaN where there is none"""
    degrees: IntArray
    """(T,) degrees of freedom: 3 per observation, or 2 with one camera"""

    @staticmethod
    def none(n_frames: int) -> "Innovations":
        """Empty record of T frames, to be filled."""
        return Innovations(np.full(n_frames, np.nan), np.zeros(n_frames, dtype=np.int64))


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class GyroBias(Displayed):
    """Gyroscope bias (reading at rest) as estimated at each frame, in IMU axes."""

    mean: FloatArray
    """(T, 3) rad/s, to be subtracted from the angular velocities of the problem's sequence"""
    covariance: FloatArray
    """(T, 3, 3)"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Estimate(Displayed):
    """Solution of a problem by one estimator; T frames, n observations in the sequence."""

    name: str
    world_T_imu: FloatArray
    """(T, 4, 4); all NaN from the frame on at which an estimator failed"""
    used: BoolArray
    """(n,) mask of the sequence's observations that were used"""
    covariance: FloatArray | None = None
    """(T, 6, 6) of the right perturbation [v, w] of each pose (m, rad); None where the estimator has none"""
    landmarks: Landmarks = field(default_factory=Landmarks.none)
    status: Status = Status.OK
    reason: str = ""
    """reason of a status other than ok, one sentence"""
    seconds: FloatArray = field(default_factory=lambda: np.empty(0))
    """(T,) time spent on each frame, s"""
    seconds_total: float = nan
    """total time including set-up and covariances, s; NaN if not given: a run then measures the call"""
    events: tuple[Event, ...] = ()
    innovations: Innovations | None = None
    """innovations (NIS) of a filter; None if it does not record them"""
    gyro_bias: GyroBias | None = None
    """gyroscope bias, if estimated along with the poses"""
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
    """further estimates of the same run at no cost, by their registered names"""

    def _heading(self) -> str:
        return f"Estimate {self.name}: {self.status}" + (f", {self.reason}" if self.reason else "")

    def _facts(self) -> Mapping[str, str]:
        known = np.asarray(np.isfinite(self.world_T_imu).all(axis=(1, 2)))
        length = path_length(self.world_T_imu[:, :3, 3])
        facts = {
            "poses": f"{known.sum():,} of {plural(len(self.world_T_imu), 'frame')}, path {length:.1f} m",
            "covariance": "of every pose" if self.covariance is not None else "none",
            "landmarks": f"{len(self.landmarks):,}; {plural(int(self.used.sum()), 'observation')} used",
            "time": "not measured" if np.isnan(self.seconds_total) else f"{self.seconds_total:.3g} s",
        }
        kinds = Counter(str(event.kind) for event in self.events).most_common()
        return facts | ({"events": ", ".join(f"{n:,} x {kind}" for kind, n in kinds)} if kinds else {})

    def to_frame(self) -> "pd.DataFrame":
        """Table with a row for each frame: x, y, z (m), qx, qy, qz, qw of `world_T_imu`, and its other quantities.

        sx, sy, sz are the 1-sigma of the position in world axes, m; vx, vy, vz the velocity, m/s; then seconds and NIS.
        A quantity that the estimate lacks has no column.
        """
        columns: dict[str, object] = {**pose_columns(self.world_T_imu)}
        if self.covariance is not None:
            R = self.world_T_imu[:, :3, :3]
            variance = np.einsum("nij,njk,nik->ni", R, self.covariance[:, :3, :3], R)
            columns |= axis_columns("s", np.sqrt(np.where(variance >= 0.0, variance, np.nan)))
        if self.velocity is not None:
            columns |= axis_columns("v", self.velocity)
        if len(self.seconds):
            columns["seconds"] = self.seconds
        if self.innovations is not None:
            columns["nis"] = self.innovations.nis
        return table(columns, "frame")

    def plot(self, axes: "Axes | None" = None) -> "Axes":
        """Draws the path in the two world axes along which it extends farthest, or in those of `axes`."""
        return plot_path(self.world_T_imu[:, :3, 3], self.name, axes)

    def transformed(self, new_T_old: FloatArray) -> "Estimate":
        """Estimate in another world, by-products included: `new_T_old` (4, 4) is the old world in the new one."""
        R, landmarks, P = new_T_old[:3, :3], self.landmarks, self.state_covariance
        covariance = None if landmarks.covariance is None else R @ landmarks.covariance @ R.T
        return replace(
            self,
            world_T_imu=new_T_old @ self.world_T_imu,
            landmarks=Landmarks(landmarks.index, se3.transform(new_T_old, landmarks.position), covariance),
            velocity=None if self.velocity is None else self.velocity @ R.T,
            state_covariance=None if P is None else strapdown.rotated_velocity(P, R, R),
            by_products={name: other.transformed(new_T_old) for name, other in self.by_products.items()},
        )

    @staticmethod
    def failed(name: str, reason: str, n_frames: int, n_observations: int) -> "Estimate":
        """Estimate of a failed estimator: NaN poses."""
        return Estimate(
            name=name,
            world_T_imu=np.full((n_frames, 4, 4), np.nan),
            used=np.zeros(n_observations, dtype=np.bool_),
            status=Status.FAILED,
            reason=reason,
            seconds=np.zeros(n_frames),
        )
