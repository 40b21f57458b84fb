"""The shape of `summary.json`. `make schema` writes it, with these descriptions, to `docs/summary.schema.json`."""

import json
from typing import Annotated, Final, Literal

from pydantic import Field

from .evidence_schema import (
    CovarianceCount,
    HeldOutError,
    HeldOutSummary,
    MapDifference,
    MovedPoints,
    NeesInDetail,
    Nis,
    ReferenceNees,
    SigmaRatio,
    Whitened,
)
from .evidence_schema import Nees as Nees
from .schema_base import Number as Number
from .schema_base import Part as _Part

SCHEMA: Final = "fgbaseline/summary/1"
"""raised when a key is renamed, removed or changes its meaning; new keys do not raise it"""


class Spread(_Part):
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


class Component(_Part):
    """Measured minus predicted, px, over all observations of the estimated landmarks."""

    bias: Number
    spread: Number


class ObservationCount(_Part):
    """How much of what the problem offered was used."""

    offered: Annotated[int, Field(description="observations of the problem, after its mask")]
    used: int
    share: Number


class TruthCount(_Part):
    """How many frames the truth metrics rest on."""

    frames: int
    missing: Annotated[int, Field(description="frames without truth, or that the estimator did not reach")]


class CommonRmse(_Part):
    """RMSE over the frames that all ranked estimators have, m."""

    rmse: Number
    frames: int


class EstimatorSummary(_Part):
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


class SequenceSummary(_Part):
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


class FindingSummary(_Part):
    """One thing that is wrong with the recording."""

    code: str
    sentence: str
    before: Annotated[Number, Field(description="a figure of the recording as it is, in `unit`")]
    after: Annotated[Number, Field(description="the same once repaired and masked")]
    unit: str
    certainty: str


class ProblemSummary(_Part):
    """What was asked."""

    preset: str
    features: int
    diagnosed: bool
    excluded: Annotated[dict[str, int], Field(description="reason -> observations that take no part")]
    pixel_sigma: float
    remarks: list[str]
    findings: Annotated[list[FindingSummary], Field(description="what the diagnosis found to be wrong")]
    repairs: Annotated[list[str], Field(description="what was repaired, and what was set by hand")]


class ReferenceSummary(_Part):
    """What the divergence is measured from."""

    name: str | None
    trust: Literal["trusted", "doubtful", "untrusted"]
    reasons: Annotated[list[str], Field(description="what the trust rests on, worst first")]


class Summary(_Part):
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
