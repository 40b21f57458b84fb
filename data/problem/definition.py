"""Estimation problem: everything that determines the optimum, independent of the estimator."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fgbaseline.geometry import FloatArray, HuberKernel, MeasurementModel

from ..dataframes import plot_over_time
from ..display import Displayed
from ..finding import Finding
from ..observations import BoolArray, IntArray, Observations
from ..sequence import Sequence
from ..wording import per_cent, plural
from .inertial import ImuIntervals, InertialStart

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class Excluded(IntEnum):
    """Reason for which an observation of the sequence is excluded from the problem."""

    NO = 0
    """not excluded"""
    FEATURE_NOT_CHOSEN = 1
    DISPARITY = 2
    """disparity too small to determine the depth"""
    ROWS = 3
    """vL and vR disagree"""
    PREDICTION = 4
    """inconsistent with its track, as predicted from the previous frame by the velocities"""
    SHORT = 5
    """remaining track too short to validate or triangulate"""
    GEOMETRY = 6
    """point undetermined, or behind a camera"""
    MOVING = 7
    """point on a moving object"""
    COPIED = 8
    """copy of the previous frame: never tracked"""
    START = 9
    """used to find the start of a recording by one camera that begins in motion: it does not count twice"""


WRONG_MATCH = (Excluded.ROWS, Excluded.PREDICTION, Excluded.GEOMETRY, Excluded.MOVING)
"""Reasons that imply a wrong match, a moving point, or wrong velocities in the prediction."""


class LandmarkMode(StrEnum):
    """Treatment of landmarks in the documented SLAM, where the source paper allows two readings."""

    UPDATED = "in-turn"
    """updated after the pose in every frame"""
    FIXED = "held"
    """fixed at their prior means"""


@dataclass(frozen=True, slots=True)
class NoiseSettings:
    """Standard deviations of the noise; defaults for recordings that could not be diagnosed."""

    pixel: float = 1.5
    """px, of each of uL, vL, uR, vR"""
    linear_velocity: float = 0.3
    """m/s, of each component of the body velocity, as the mean over an interval"""
    angular_velocity: float = 0.03
    """rad/s, of each component of the angular rate, as the mean over an interval"""


@dataclass(frozen=True, slots=True)
class InverseDepthPrior:
    """Gaussian prior of the inverse depth of a point at its first observation, for filters with one camera.

    It is not in the cost of the problem: smoothers defer a landmark until its parallax determines it.
    """

    mean: float
    """1/m"""
    sigma: float
    """1/m"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class LandmarkPrior(Displayed):
    """Gaussian prior of every chosen landmark, independent of the others, in the world frame."""

    mean: FloatArray
    """(m, 3) m, one row per chosen feature"""
    covariance: FloatArray
    """(3, 3) m^2, the same for all"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Problem(Displayed):
    """State estimation problem over T frames: world_T_imu of every frame and the positions of m landmarks.

    The estimate minimizes the sum of squared whitened residuals of

    - the increments: right perturbation [v, w], covariance `increment_covariance`;
    - the observations: rows of `measurement`, three of a stereo pair and two of one camera, `kernel` on their norm;
    - the first pose, `initial_pose` with `initial_covariance` (zero: fixed), and `landmark_prior` if there is one.

    With raw inertial data each frame also has a velocity and biases. Preintegrated samples (`imu`) take the place of
    the increments, `start` that of `initial_covariance`, and z of the world points up.
    """

    preset: str
    sequence: Sequence
    """the recording as the estimators see it: repaired, where the preset repairs"""
    increment: FloatArray
    """(T-1, 6) twist [v, w] of the body times dt (m, rad): world_T_imu[k+1] = world_T_imu[k] exp(hat(increment[k]));
    (0, 6) with raw inertial data"""
    increment_covariance: FloatArray
    """(T-1, 6, 6); (0, 6, 6) with raw inertial data"""
    pixel_variance: float
    """px^2, of each of uL, vL, uR, vR, or uL, vL"""
    features: IntArray
    """(m,) increasing indices of the chosen landmarks"""
    excluded: NDArray[np.uint8]
    """(n,) `Excluded` code of each observation of the sequence"""
    initial_pose: FloatArray
    """(4, 4) world_T_imu of frame 0"""
    initial_covariance: FloatArray
    """(6, 6) of the right perturbation [v, w] of the first pose, m and rad; zero fixes the pose"""
    imu: ImuIntervals | None = None
    """samples between the frames, where the recording has raw inertial data"""
    start: InertialStart | None = None
    """velocity, biases and covariance (15, 15) at frame 0; given together with `imu`"""
    inverse_depth_prior: InverseDepthPrior | None = None
    """prior of the depths of the scene, for one camera"""
    landmark_prior: LandmarkPrior | None = None
    kernel: HuberKernel | None = None
    mapping_pixel_variance: float | None = None
    """px^2, in place of `pixel_variance` where landmarks are mapped along given poses (the source paper has V = I
    there)"""
    landmark_mode: LandmarkMode = LandmarkMode.UPDATED
    pixel_inflation: float = 1.0
    """factor in the pixel sigma for time-correlated track errors: residuals are then expected at its inverse"""
    diagnosed: bool = False
    """True if noise and repairs are estimated from the recording"""
    findings: tuple[Finding, ...] = ()
    """faults of the recording, from reader and diagnosis"""
    repairs: tuple[str, ...] = ()
    """repairs common to all estimators, and user-specified values; one sentence each"""
    remarks: tuple[str, ...] = ()
    """choices made in building the problem, one sentence each"""

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return self.sequence.n_frames

    @property
    def measurement(self) -> MeasurementModel:
        """The measurement model, with noise and kernel."""
        return MeasurementModel(self.sequence.camera, self.pixel_variance, self.kernel)

    @property
    def mapping_measurement(self) -> MeasurementModel:
        """The measurement model with the noise for mapping landmarks along given poses."""
        return self.measurement.with_variance(self.mapping_pixel_variance or self.pixel_variance)

    @property
    def mask(self) -> BoolArray:
        """Mask (n,) of the sequence's observations that are used."""
        mask: BoolArray = self.excluded == Excluded.NO
        return mask

    @property
    def of_chosen_features(self) -> BoolArray:
        """Mask (n,) of the sequence's observations of chosen features, masked ones included.

        All are True if no feature was left out. `excluded` alone does not decide: a masked observation has the code of
        its mask, whether or not its feature is chosen.
        """
        if not (self.excluded == Excluded.FEATURE_NOT_CHOSEN).any():
            return np.ones(len(self.excluded), dtype=np.bool_)
        return np.isin(self.sequence.observations.landmark, self.features)

    def _heading(self) -> str:
        return f"Problem {self.preset} of {self.sequence.name}"

    def _facts(self) -> Mapping[str, str]:
        n, used = len(self.excluded), int(self.mask.sum())
        kernel = "no kernel" if self.kernel is None else f"Huber kernel at {self.kernel.threshold:g} sigma"
        noise = "estimated" if self.diagnosed else "assumed"
        inflated = f" (inflated {self.pixel_inflation:.1f} times)" if self.pixel_inflation > 1.0 else ""
        landmarks = plural(len(self.features), "landmark")
        return {
            "frames": f"{self.n_frames:,}",
            "observations": f"{used:,} of {n:,} ({per_cent(used / max(n, 1))}), {landmarks}",
            "noise": f"pixel sigma {self.pixel_variance**0.5:.3g} px{inflated}, {kernel}; {noise}",
            "repairs": "; ".join(text.rstrip(".") for text in self.repairs) or "none",
            **{f"remark {i}": text for i, text in enumerate(self.remarks, 1)},
        }

    def to_frame(self) -> "pd.DataFrame":
        """Table of the sequence's observations (`Observations.to_frame`), and why each is `excluded` (or empty)."""
        words = np.array(["" if e is Excluded.NO else e.name.lower().replace("_", " ") for e in Excluded])
        return self.sequence.observations.to_frame().assign(excluded=words[self.excluded])

    def plot(self) -> "Figure":
        """Draws the numbers of observations in each frame, all and used, over time."""
        t, frame = self.sequence.t - self.sequence.t[0], self.sequence.observations.frame
        counts = {"all": frame, "used": frame[self.mask]}
        lines = {name: (t, np.bincount(of, minlength=self.n_frames).astype(np.float64)) for name, of in counts.items()}
        return plot_over_time({"observations": lines}, self._heading())

    def observations(self) -> Observations:
        """Observations that are used, with landmark indices of the sequence."""
        return self.sequence.observations.select(self.mask)

    def scatter_mask(self, taken: BoolArray) -> BoolArray:
        """Mask (n,) over the sequence's observations, as `Estimate.used` has it, from one over `observations()`."""
        scattered = self.mask
        scattered[scattered] = taken
        return scattered

    def feature_row(self, landmark: IntArray) -> IntArray:
        """Rows (...) in `features` of landmark indices that are among them."""
        return np.searchsorted(self.features, landmark).astype(np.int64)
