"""Settings of the joint filter: landmark representation, linearization, gates, bias and state size."""

from dataclasses import dataclass
from enum import StrEnum

from fgbaseline.data.problem import Problem
from fgbaseline.geometry import FgbaselineError

from .gyro_bias import GyroBiasPrior
from .landmark_representation import LandmarkRepresentation


class Linearization(StrEnum):
    """Treatment of the unobservable directions: the common position and orientation of path and map in the world.

    Six directions of the error state, N = [Ad(T^-1); d xi / d g], move everything by one rigid motion g, and H N = 0;
    raw inertial samples determine two of them, roll and pitch. N depends on the estimate, which every update changes.
    The textbook filter then gains spurious information along N and becomes overconfident (Huang, Mourikis and
    Roumeliotis, IJRR 2010).
    """

    TEXTBOOK = "textbook"
    """Jacobians at the latest estimate, P unchanged"""
    FIRST_ESTIMATE = "first-estimate"
    """FEJ: Jacobians of landmarks at initialization and of poses as predicted, so that N is constant (same paper)"""
    INVARIANT = "invariant"
    """Jacobians at the latest estimate; after an update P <- B P B^T, where B takes N at the prediction to N at the
    result and is the identity as nearly as that allows: P then has its meaning in coordinates in which N does not
    change, those of the right-invariant filter (Barrau and Bonnabel, 2015; Zhang et al., IEEE RA-L 2017)"""


@dataclass(frozen=True, slots=True)
class JointSettings:
    """Settings of the joint filter. Raises FgbaselineError, naming setting and value, for an invalid one."""

    coordinates: LandmarkRepresentation = LandmarkRepresentation.INVERSE_DEPTH
    """representation of landmarks without a prior; those with a prior use world coordinates, in which it is Gaussian"""
    linearization: Linearization = Linearization.INVARIANT
    gate: float | None = 0.9999
    """chi-square probability of the gate, which rejects one inlier in ten thousand; None: no gate"""
    disagreeing_share: float | None = 0.5
    """a frame is rejected where more than this share of its observations is beyond 5.5 sigma; None: never"""
    gyro_bias: GyroBiasPrior | None = None
    """prior of an estimated gyroscope bias; None: the bias is not estimated"""
    unseen_frames: int = 2
    """consecutive frames without an observation after which a landmark is marginalized; the mask interrupts tracks for
    that long"""
    max_landmarks: int = 512
    """most landmarks in the state; further ones are deferred (`feature_selection`), with an event"""

    @classmethod
    def of(cls, problem: Problem) -> "JointSettings":
        """Default settings for a problem.

        With one camera no frame is rejected as a whole: depths and scale are found from frames that disagree at first.
        """
        return cls(disagreeing_share=None) if problem.sequence.monocular else cls()

    def __post_init__(self) -> None:
        if self.gate is not None and not 0.0 < self.gate < 1.0:
            raise FgbaselineError(f"gate: expected a probability between 0 and 1, or None, got {self.gate!r}")
        if self.disagreeing_share is not None and not 0.0 < self.disagreeing_share <= 1.0:
            raise FgbaselineError(
                f"disagreeing_share: expected a share above 0 and at most 1, or None, got {self.disagreeing_share!r}"
            )
        if self.unseen_frames < 0:
            raise FgbaselineError(f"unseen_frames: expected at least 0, got {self.unseen_frames!r}")
        if self.max_landmarks < 1:
            raise FgbaselineError(f"max_landmarks: expected at least 1, got {self.max_landmarks!r}")

    @staticmethod
    def textbook() -> "JointSettings":
        """Textbook EKF-SLAM: points in the world, Jacobians at the latest estimate, no gate of single observations."""
        return JointSettings(LandmarkRepresentation.WORLD, Linearization.TEXTBOOK, gate=None)
