"""The parts of `summary.json` on consistency, residuals, map and held-out tracks."""

from typing import Annotated

from pydantic import Field

from .schema_base import Number, Part


class Nees(Part):
    """Normalised estimation error squared of the poses against truth, error log(T^-1 T_true) in the body frame."""

    mean: Annotated[Number, Field(description="6 is expected")]
    median: Annotated[Number, Field(description="5.35 is expected")]
    frames: int


class NeesInDetail(Nees):
    """The same, with position and rotation apart."""

    position_mean: Annotated[Number, Field(description="of the position alone; 3 is expected")]
    rotation_mean: Annotated[Number, Field(description="of the rotation alone; 3 is expected")]
    inside_95: Annotated[
        Number, Field(description="share of the frames inside the 95 % bounds of a single one; frames are correlated")
    ]


class CovarianceCount(Part):
    """What the covariances of the poses are worth."""

    frames: Annotated[int, Field(description="that have a covariance, be it one or not")]
    held: Annotated[int, Field(description="with a covariance of zero: the first pose")]
    not_positive_definite: int
    where: Annotated[str, Field(description="the frames that are not positive definite, such as '3, 7 to 9'")]


class ReferenceNees(Part):
    """NEES of the difference from the reference, with P - P_ref as its covariance; 6 is expected."""

    mean: Number
    median: Number
    inside_95: Annotated[Number, Field(description="share of the frames inside the 95 % bounds of a single one")]
    frames: int
    left_out: Annotated[int, Field(description="frames in which P - P_ref is not positive definite")]


class SigmaRatio(Part):
    """Median over the frames of the estimate's sigma over the reference's; a filter's should be above 1."""

    position: Number
    rotation: Number


class Nis(Part):
    """Normalised innovation squared of a filter, of the rows (uL, uR, (vL + vR) / 2), before kernel and gates."""

    per_degree: Annotated[Number, Field(description="over its degrees of freedom; 1 is expected")]
    low: Annotated[Number, Field(description="95 % bound of per_degree, innovations independent from frame to frame")]
    high: Number
    inside_95: Annotated[Number, Field(description="share of the frames inside their own 95 % bounds")]
    frames: int


class Whitened(Part):
    """Residuals of the observations it used over the noise assumed, track by track against chi-square."""

    ratio: Annotated[Number, Field(description="squared residuals over their degrees of freedom; 1 is expected")]
    beyond_95: Annotated[Number, Field(description="share of the tracks beyond their 95 % quantile; 0.05 is expected")]
    spread_uL: Annotated[Number, Field(description="RMS in sigmas, a little below 1 expected")]
    spread_uR: Number
    spread_v: Number
    tracks: int


class MovedPoints(Part):
    """Tracks whose residuals say that the point moved, or that the track slid over it."""

    tracks: Annotated[int, Field(description="long enough to be asked")]
    moved: int
    share: Number


class MapDifference(Part):
    """Landmarks matched by number with those of the reference."""

    n: int
    median: Annotated[Number, Field(description="distance in the world, drift included, m")]
    median_seen: Annotated[Number, Field(description="distance as the two cameras see it, without drift, m")]
    median_sigmas: Annotated[
        Number, Field(description="world distance over the covariance P - P_ref; 1.54 is expected")
    ]
    with_sigmas: int
    left_out: Annotated[int, Field(description="landmarks for which P - P_ref is not positive definite")]


class HeldOutError(Part):
    """Errors on tracks that no estimator saw, predicted from the other half of the track, px."""

    rank: Annotated[int, Field(description="1 for the smallest median")]
    median: Number
    low: Annotated[Number, Field(description="of a 95 % interval of the median (block bootstrap)")]
    high: Number
    behind: Annotated[Number, Field(description="median minus the best one")]
    behind_low: Annotated[Number, Field(description="of a 95 % interval; one that holds 0 cannot tell the two apart")]
    behind_high: Number
    p95: Number
    under_3px: Annotated[Number, Field(description="share, 0 to 1")]


class HeldOutSummary(Part):
    """The tracks that were taken out before diagnosis and estimators."""

    share: float
    seed: int
    tracks: int
    observations: int
    pieces: Annotated[int, Field(description="of tracks that do not jump, where all estimators have poses")]
    inliers: Annotated[int, Field(description="pieces that at least one path explains: the same for all")]
    gate_px: Annotated[float, Field(description="error below which a path explains a piece")]
    judged: Annotated[int, Field(description="observations that the errors are over, the same for all")]
