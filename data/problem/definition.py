"""The problem that every estimator solves: all that decides the optimum is here, and none of it in an estimator."""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FloatArray, HuberKernel, StereoMeasurement

from ..finding import Finding
from ..observations import BoolArray, IntArray, Observations
from ..sequence import Sequence
from .inertial import ImuIntervals, InertialStart


class Excluded(IntEnum):
    """Why an observation of the sequence takes no part in the problem."""

    NO = 0
    """it takes part"""
    FEATURE_NOT_CHOSEN = 1
    DISPARITY = 2
    """disparity too small to tell the depth"""
    ROWS = 3
    """vL and vR disagree"""
    PREDICTION = 4
    """disagrees with its own track, predicted from the frame before by the velocities"""
    SHORT = 5
    """what is left of its track is too short to check or to determine a point"""
    GEOMETRY = 6
    """its point is not determined, or lies behind a camera"""
    MOVING = 7
    """its point moved"""
    COPIED = 8
    """a copy of the frame before: it was never tracked"""


WRONG_MATCH = (Excluded.ROWS, Excluded.PREDICTION, Excluded.GEOMETRY, Excluded.MOVING)
"""Reasons that say that a match is wrong, that its point moved, or that the velocities that predict it are wrong."""


class LandmarkMode(StrEnum):
    """Treatment of landmarks in the documented SLAM, which can be read either way."""

    UPDATED = "in-turn"
    """updated after the pose in every frame"""
    FIXED = "held"
    """fixed at their prior means"""


@dataclass(frozen=True, slots=True)
class NoiseSettings:
    """Standard deviations; the defaults stand in where a recording could not be diagnosed."""

    pixel: float = 1.5
    """px, of each of the four rows"""
    linear_velocity: float = 0.3
    """m/s, of the velocity held over an interval"""
    angular_velocity: float = 0.03
    """rad/s, of the rate held over an interval"""


@dataclass(frozen=True, eq=False, slots=True)
class LandmarkPrior:
    """An independent Gaussian prior on every chosen landmark, in the world frame."""

    mean: FloatArray
    """(m, 3) m, one row per chosen feature"""
    covariance: FloatArray
    """(3, 3) m^2, the same for all"""


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """A state estimation problem over T frames: world_T_imu of every frame and the positions of m landmarks.

    With raw inertial data each frame also has a velocity and biases: `imu` takes the place of the increments, `start`
    that of `initial_covariance`, and z of the world points up.

    Minimize the sum of squared whitened residuals of the increments (right perturbation [v, w], covariance
    `increment_covariance`), of the stereo observations (each of the four rows with variance `pixel_variance`,
    under `kernel`) and of `landmark_prior`, with the first pose at `initial_pose` with `initial_covariance`
    (zero: held).
    """

    preset: str
    sequence: Sequence
    """the recording as the estimators see it: repaired, where the preset repairs"""
    increment: FloatArray
    """(T-1, 6) twist [v, w] times dt (m, rad): frame k to frame k+1 is exp(hat(increment[k])); (0, 6) with raw inertial
    data"""
    increment_covariance: FloatArray
    """(T-1, 6, 6); (0, 6, 6) with raw inertial data"""
    pixel_variance: float
    """px^2, of each of uL, vL, uR, vR"""
    features: IntArray
    """(m,) increasing indices of the chosen landmarks"""
    excluded: NDArray[np.uint8]
    """(n,) an `Excluded` for each observation of the sequence"""
    initial_pose: FloatArray
    """(4, 4) world_T_imu of frame 0"""
    initial_covariance: FloatArray
    """(6, 6) of the right perturbation of the first pose; zero holds it"""
    imu: ImuIntervals | None = None
    """samples between the frames, where the recording has raw inertial data"""
    start: InertialStart | None = None
    """velocity, biases and covariance (15, 15) at frame 0; given together with `imu`"""
    landmark_prior: LandmarkPrior | None = None
    kernel: HuberKernel | None = None
    mapping_pixel_variance: float | None = None
    """px^2, in place of `pixel_variance` where landmarks are mapped along given poses (the report has V = I there)"""
    landmark_mode: LandmarkMode = LandmarkMode.UPDATED
    diagnosed: bool = False
    """whether noise and repairs are estimated from the recording"""
    findings: tuple[Finding, ...] = ()
    """faults of the recording, from reader and diagnosis"""
    repairs: tuple[str, ...] = ()
    """what was repaired for all estimators alike, and user-specified values; one sentence each"""
    remarks: tuple[str, ...] = ()
    """decisions in building the problem, one sentence each"""

    @property
    def n_frames(self) -> int:
        """T, the number of frames."""
        return self.sequence.n_frames

    @property
    def measurement(self) -> StereoMeasurement:
        """The measurement model, with noise and kernel."""
        return StereoMeasurement(self.sequence.camera, self.pixel_variance, self.kernel)

    @property
    def mapping_measurement(self) -> StereoMeasurement:
        """The measurement model with the noise for mapping landmarks along given poses."""
        return self.measurement.with_variance(self.mapping_pixel_variance or self.pixel_variance)

    @property
    def mask(self) -> BoolArray:
        """(n,) true for the sequence's observations that take part."""
        mask: BoolArray = self.excluded == Excluded.NO
        return mask

    def observations(self) -> Observations:
        """The observations that take part, with landmark indices of the sequence."""
        return self.sequence.observations.select(self.mask)

    def scatter_mask(self, taken: BoolArray) -> BoolArray:
        """(n,) flags of `observations()` scattered over the sequence's observations, as `Estimate.used` has them."""
        scattered = self.mask
        scattered[scattered] = taken
        return scattered

    def feature_row(self, landmark: IntArray) -> IntArray:
        """The rows (…,) in `features` of landmark indices that are among them."""
        return np.searchsorted(self.features, landmark).astype(np.int64)
