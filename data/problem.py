"""What every estimator is asked to solve: whatever decides the optimum stands here, and in no estimator."""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FloatArray, HuberKernel, StereoMeasurement

from .finding import Finding
from .observations import BoolArray, IntArray, Observations
from .sequence import Sequence


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


class Reading(StrEnum):
    """The two readings of the documented SLAM: are landmarks updated along with the pose, or held?"""

    IN_TURN = "in-turn"
    HELD = "held"


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

    Minimise the sum of squared whitened residuals of the increments (right perturbation [v, w], covariance
    `increment_covariance`), of the stereo observations (each of the four rows with variance `pixel_variance`,
    under `kernel`) and of `landmark_prior`, with the first pose at `initial_pose` with `initial_covariance`
    (zero: held).
    """

    preset: str
    sequence: Sequence
    """the recording as the estimators see it: repaired, where the preset repairs"""
    increment: FloatArray
    """(T-1, 6) twist [v, w] times dt (m, rad): frame k to frame k+1 is exp(hat(increment[k]))"""
    increment_covariance: FloatArray
    """(T-1, 6, 6)"""
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
    landmark_prior: LandmarkPrior | None = None
    kernel: HuberKernel | None = None
    mapping_pixel_variance: float | None = None
    """px^2, in place of `pixel_variance` where landmarks are mapped along given poses (the report has V = I there)"""
    reading: Reading = Reading.IN_TURN
    diagnosed: bool = False
    """whether the noise and the repairs are those that the recording itself told"""
    findings: tuple[Finding, ...] = ()
    """what the reader and the diagnosis found to be wrong with the recording"""
    repairs: tuple[str, ...] = ()
    """what was done about it for all estimators alike, and what was set by hand; one sentence each"""
    remarks: tuple[str, ...] = ()
    """what was decided in building the problem, one sentence each"""

    @property
    def n_frames(self) -> int:
        """How many frames there are: T."""
        return self.sequence.n_frames

    @property
    def measurement(self) -> StereoMeasurement:
        """What an observation measures, with its noise and kernel."""
        return StereoMeasurement(self.sequence.camera, self.pixel_variance, self.kernel)

    @property
    def mapping_measurement(self) -> StereoMeasurement:
        """The same with the noise that landmarks are mapped with along given poses."""
        return self.measurement.with_variance(self.mapping_pixel_variance or self.pixel_variance)

    @property
    def mask(self) -> BoolArray:
        """(n,) which of the sequence's observations take part."""
        mask: BoolArray = self.excluded == Excluded.NO
        return mask

    def observations(self) -> Observations:
        """The observations that take part, with landmark indices of the sequence."""
        return self.sequence.observations.select(self.mask)

    def spread(self, taken: BoolArray) -> BoolArray:
        """(n,) over the sequence's observations of flags over `observations()`: what `Estimate.used` wants."""
        spread = self.mask
        spread[spread] = taken
        return spread

    def feature_row(self, landmark: IntArray) -> IntArray:
        """The rows (…,) in `features` of landmark indices that are among them."""
        return np.searchsorted(self.features, landmark).astype(np.int64)
