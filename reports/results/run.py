"""The models of `summary.json`; `make schema` writes its schema to `docs/summary.schema.json`."""

import json
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

Number = float | None
"""null for what is not a finite number; `notes` then says why"""


class Part(BaseModel):
    """An object of the file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


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


SCHEMA: Final = "fgbaseline/summary/1"
"""raised when a key is renamed, removed or changes its meaning; new keys do not raise it"""


class Spread(Part):
    """Statistics of errors in m, over the frames that have one; null with the note `infinite` where one is infinite."""

    rmse: Number
    mean: Number
    median: Number
    p95: Number
    max: Number
    missing: Annotated[int, Field(description="errors that are NaN, which the figures leave out")]


class Divergence(Spread):
    """Of each pose from the reference's, m, without alignment."""

    final: Number
    rotation_rmse_deg: Number
    rotation_final_deg: Number


class Reprojection(Spread):
    """Norm of the four pixel differences (uL, vL, uR, vR), px."""

    under_3px: Annotated[Number, Field(description="share, 0 to 1")]
    behind_camera: Annotated[int, Field(description="observations whose landmark lies behind the camera")]
    n: Annotated[int, Field(description="observations that the figures are over")]


class Component(Part):
    """Measured minus predicted, px, over all observations of the estimated landmarks."""

    bias: Number
    spread: Number


class ObservationCount(Part):
    """How much of what the problem offered was used."""

    offered: Annotated[int, Field(description="observations of the problem, after its mask")]
    used: int
    share: Number


class TruthCount(Part):
    """How many frames the truth metrics rest on."""

    frames: int
    missing: Annotated[int, Field(description="frames without truth, or that the estimator did not reach")]


class CommonRmse(Part):
    """RMSE over the frames that all ranked estimators have, m."""

    rmse: Number
    frames: int


class EstimatorSummary(Part):
    """One estimator."""

    status: Literal["ok", "recovered", "failed"]
    reason: Annotated[str, Field(description="why the status is not ok, in a sentence")]
    seconds: Annotated[float, Field(description="for the whole answer, s")]
    frames_per_second: Number
    reprojection: Annotated[Reprojection, Field(description="over all observations of the landmarks it estimated")]
    reprojection_used: Annotated[Reprojection, Field(description="over those it used")]
    reprojection_common: Annotated[Reprojection, Field(description="over those that every estimator used")]
    components: dict[str, Component]
    divergence: Divergence | None
    coverage: Annotated[float, Field(description="share of the recording's time in which it has poses")]
    divergence_common: Annotated[
        CommonRmse | None, Field(description="over the frames that all ranked estimators have: what ranks it")
    ]
    ate_common: Annotated[CommonRmse | None, Field(description="the same of the error to truth after alignment")]
    ate: Annotated[Spread | None, Field(description="position against truth after SE(3) alignment, m")]
    ate_unaligned: Annotated[Divergence | None, Field(description="pose against truth as it is")]
    truth: TruthCount | None
    nees: NeesInDetail | None
    covariance: CovarianceCount | None
    nees_reference: ReferenceNees | None
    sigma_ratio: SigmaRatio | None
    nis: Nis | None
    whitened: Whitened
    moved_points: MovedPoints
    map: MapDifference | None
    held_out: HeldOutError | None
    landmarks: int
    observations: ObservationCount
    samples: Annotated[
        dict[str, dict[str, float]],
        Field(description="by the beginning of a metric's path: n that it is taken over, coverage of the time"),
    ]
    events: Annotated[dict[str, int], Field(description="kind of event -> how often")]
    notes: Annotated[dict[str, str], Field(description="why values are null: by key, for all below it; * for all")]


class SequenceSummary(Part):
    """What was recorded."""

    name: str
    source: str
    form: str
    frames: int
    duration_s: float
    observations: int
    tracks: int
    path_length_m: Annotated[
        Number, Field(description="of the truth, else of the reference; null where there is neither")
    ]
    up: Annotated[list[float], Field(description="unit vector that points up in the world of the trajectories")]
    ahead: Annotated[list[float], Field(description="unit vector, level: where the camera looks at the start")]
    remarks: list[str]


class FindingSummary(Part):
    """One thing that is wrong with the recording."""

    code: str
    sentence: str
    before: Annotated[Number, Field(description="a figure of the recording as it is, in `unit`")]
    after: Annotated[Number, Field(description="the same once repaired and masked")]
    unit: str
    certainty: str


class ProblemSummary(Part):
    """What was asked."""

    preset: str
    features: int
    diagnosed: bool
    excluded: Annotated[dict[str, int], Field(description="reason -> observations that take no part")]
    pixel_sigma: float
    remarks: list[str]
    findings: Annotated[list[FindingSummary], Field(description="what the diagnosis found to be wrong")]
    repairs: Annotated[list[str], Field(description="what was repaired, and what was set by hand")]


class ReferenceSummary(Part):
    """What the divergence is measured from."""

    name: str | None
    trust: Literal["trusted", "doubtful", "untrusted"]
    reasons: Annotated[list[str], Field(description="what the trust rests on, worst first")]


class Summary(Part):
    """A run."""

    schema_: Annotated[Literal["fgbaseline/summary/1"], Field(alias="schema")] = SCHEMA
    sequence: SequenceSummary
    problem: ProblemSummary
    reference: ReferenceSummary
    held_out: Annotated[HeldOutSummary | None, Field(description="null where no tracks were held out")]
    estimators: dict[str, EstimatorSummary]
    settings: dict[str, str | int | float | bool | None]
    versions: dict[str, str]
    machine: dict[str, str | int]


def json_schema() -> str:
    """The JSON schema of `summary.json`, as text."""
    schema = Summary.model_json_schema(by_alias=True, mode="serialization")
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2)


if __name__ == "__main__":
    print(json_schema())
