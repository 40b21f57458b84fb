"""How the joint filter solves a problem."""

from dataclasses import dataclass
from enum import StrEnum

from fgbaseline.geometry import FgbaselineError

from .gyro_bias import GyroBiasPrior
from .landmark_representation import LandmarkRepresentation


class Linearization(StrEnum):
    """What keeps the filter from learning what no observation tells: where path and map lie together in the world.

    Six directions of the error state, N = [Ad(T^-1); d xi / d g], move everything by one rigid motion g, and H N = 0.
    They depend on the estimate, which every update changes; the textbook's P then has less uncertainty along the new
    ones than along the old, and the filter has learnt what it cannot know (Huang, Mourikis and Roumeliotis, IJRR 2010).
    """

    TEXTBOOK = "textbook"
    """Jacobians at the newest estimate, P as it is"""
    FIRST_ESTIMATE = "first-estimate"
    """Jacobians of landmarks where they entered and of poses as predicted, so that N stays the same (the same paper)"""
    INVARIANT = "invariant"
    """Jacobians at the newest estimate; after an update P <- B P B^T, where B takes N at the prediction to N at the
    result and is the identity as nearly as that allows: P then has its meaning in coordinates in which N does not
    change, those of the right-invariant filter (Barrau and Bonnabel, 2015; Zhang et al., IEEE RA-L 2017)"""


@dataclass(frozen=True, slots=True)
class JointSettings:
    """Raises FgbaselineError, naming setting and value, for what cannot be."""

    coordinates: LandmarkRepresentation = LandmarkRepresentation.INVERSE_DEPTH
    """of landmarks without a prior; those with one are in world coordinates, in which the prior is Gaussian"""
    linearization: Linearization = Linearization.INVARIANT
    gate: float | None = 0.9999
    """chi-square probability: an observation whose innovation is beyond it is rejected, one good one in ten thousand;
    None: none is"""
    disagreeing_share: float | None = 0.5
    """a frame takes no part where more than this share of its observations is beyond 5.5 sigma; None: it always does"""
    gyro_bias: GyroBiasPrior | None = None
    """estimate a gyroscope bias along with the pose; None: the angular velocities have none"""
    unseen_frames: int = 2
    """frames in a row that a landmark stays in the state without an observation, before it is marginalized; the mask
    interrupts tracks for that long"""
    max_landmarks: int = 512
    """in the state at once; where a frame shows more, they wait outside (`admission`), and that is told"""

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
        """EKF-SLAM as textbooks print it: points in the world, Jacobians at the newest estimate, no gate."""
        return JointSettings(LandmarkRepresentation.WORLD, Linearization.TEXTBOOK, gate=None)
