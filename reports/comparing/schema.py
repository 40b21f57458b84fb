"""The shape of `comparison.json`. `make schema` writes it, with these descriptions, to docs/comparison.schema.json."""

import json
from typing import Annotated, Final, Literal

from pydantic import Field

from ..schema import Reprojection
from ..schema_base import Number, Part

SCHEMA: Final = "fgbaseline/comparison/1"
"""raised when a key is renamed, removed or changes its meaning; new keys do not raise it"""


class Statistic(Part):
    """A figure with its 95 % confidence interval, of a block bootstrap that respects correlation in time."""

    value: Number
    low: Number
    high: Number


class Statistics(Part):
    """Of errors that follow each other in time."""

    rmse: Statistic
    mean: Statistic
    median: Statistic
    std: Statistic
    p95: Statistic
    min: Number
    max: Number
    sse: Annotated[Number, Field(description="sum of squares")]
    n: int
    missing: Annotated[int, Field(description="errors that are NaN, which the figures leave out")]
    block: Annotated[int, Field(description="errors in a row that the bootstrap keeps together")]
    reliable: Annotated[bool, Field(description="whether so many blocks fit that the intervals mean something")]


class Pairing(Part):
    """Which poses were compared."""

    pairs: int
    association: Literal["nearest", "interpolated"]
    tolerance_s: float
    offset_s: Annotated[float, Field(description="added to the estimate's stamps")]
    offset_range_s: Annotated[
        tuple[float, float] | None, Field(description="where it was searched for: offsets that fit nearly as well")
    ]
    offset_determined: Annotated[bool | None, Field(description="null where it was not searched for")]
    left_out_reference: int
    left_out_estimate: int


class AlignmentSummary(Part):
    """p -> scale * rotation @ p + translation, applied to the estimate."""

    kind: Literal["none", "first-pose", "yaw", "se3", "sim3"]
    rotation: list[list[float]]
    translation: list[float]
    scale: float
    poses: Annotated[int, Field(description="pairs that decided it")]
    free: Annotated[list[str], Field(description="what the positions of the paths left open")]


class Relative(Part):
    """Errors of the motions between poses a delta apart."""

    translation: Annotated[Statistics, Field(description="m")]
    rotation_deg: Statistics


class SegmentsOfLength(Part):
    """Segments of one length."""

    length: float
    translation_percent: float
    rotation_deg_per_m: float
    n: int


class Segments(Part):
    """KITTI's segment errors."""

    translation_percent: Number
    rotation_deg_per_m: Number
    official: Annotated[bool, Field(description="KITTI's own lengths and step: comparable with published figures")]
    by_length: list[SegmentsOfLength]
    intervals: Annotated[dict[str, Statistic], Field(description="of both means, by their names")]


class Rate(Part):
    """A drift."""

    value: Number
    low: Number
    high: Number
    unit: str
    over: str
    n: int


class Consistency(Part):
    """Normalised estimation error squared of the poses; 6 is expected."""

    mean: Number
    median: Number
    frames: int
    not_positive_definite: Annotated[int, Field(description="covariances that are none; left out")]


class Common(Part):
    """The positions over the moments that all estimates have which are ranked."""

    moments: int
    rmse: Annotated[Statistic, Field(description="m; what the ranks are by")]


class Behind(Statistic):
    """The RMSE of the positions less that of the estimate nearest to the reference, of a paired block bootstrap."""

    block: int
    reliable: bool


class MapOfDepth(Part):
    """Medians of one class of depth, m."""

    depth: str
    n: int
    distance: Number
    seen: Number


class MapDifference(Part):
    """Landmarks matched by number with the reference's, aligned as the path is."""

    n: int
    median: Annotated[Number, Field(description="m, in the world")]
    p95: Number
    median_seen: Annotated[Number, Field(description="m, each in the frame of its own camera: without drift")]
    by_depth: list[MapOfDepth]


class HeldOutFigures(Part):
    """Errors on tracks that were in no problem, px, over the same observations for all."""

    median: Statistic
    behind: Annotated[Statistic, Field(description="by how much the median is above the best one")]
    p95: Number
    under_3px: Number


class Shares(Part):
    """What the position difference is made of: shares of its sum of squares, which add to one."""

    scale: Number
    heading: Number
    noise: Number
    scale_percent: Number
    heading_deg: Number
    heading_deg_per_s: Annotated[Number, Field(description="per pose without stamps")]
    intervals: Annotated[dict[str, Statistic], Field(description="of the three shares")]
    reliable: bool


class Passing(Part):
    """When the position difference is first beyond a bound."""

    bound_m: float
    t: Number
    travelled_m: Number


class EstimateSummary(Part):
    """One estimate."""

    source: str
    poses: int
    coverage: Annotated[Number, Field(description="share of the reference's time in which there are paired poses")]
    rank: Annotated[
        int | None,
        Field(description="1 for the nearest over the common moments; null for by-products and for too few moments"),
    ]
    caption: Annotated[str, Field(description="what was paired and how it was aligned, in words")]
    remarks: Annotated[list[str], Field(description="what was recognized in its file; the subject is its name")]
    pairing: Pairing
    alignment: AlignmentSummary
    translation: Annotated[Statistics, Field(description="m; its RMSE is the absolute trajectory error")]
    rotation_deg: Statistics
    pose: Annotated[Statistics, Field(description="Frobenius norm of E - I, no unit")]
    relative: dict[str, Relative]
    segments: Segments | None
    drift: dict[str, Rate] | None
    nees: Annotated[
        Consistency | None, Field(description="of its own covariances, against a reference taken for the truth")
    ]
    shares: Shares
    common: Annotated[Common | None, Field(description="null where there is no such moment, or it has too few")]
    behind: Annotated[Behind | None, Field(description="null for the nearest, and for by-products of the reference")]
    final_m: Number
    passing: Passing
    reprojection: Annotated[Reprojection | None, Field(description="over all observations of the landmarks it gave")]
    reprojection_common: Annotated[
        Reprojection | None, Field(description="the same over those of the problem that all gave a landmark for")
    ]
    reprojection_along: Annotated[
        Reprojection | None, Field(description="with landmarks triangulated along its path, the same way for all")
    ]
    map: MapDifference | None
    held_out: HeldOutFigures | None
    samples: Annotated[
        dict[str, dict[str, float]],
        Field(description="by the beginning of a metric's path: n that it is taken over, coverage of its own time"),
    ]
    notes: Annotated[dict[str, str], Field(description="why something is null or missing, by key")]


class ReferenceSummary(Part):
    """What everything is compared with."""

    name: str
    source: str
    poses: int
    duration_s: Number
    path_m: float
    trust: Annotated[
        Literal["trusted", "doubtful", "untrusted"] | None, Field(description="of a run's reference; null for files")
    ]
    reasons: list[str]
    remarks: Annotated[list[str], Field(description="what was recognized in its file; the subject is its name")]
    reprojection: Reprojection | None
    reprojection_common: Reprojection | None
    reprojection_along: Reprojection | None
    held_out: HeldOutFigures | None


class Up(Part):
    """The direction that points up in the world of the reference."""

    direction: tuple[float, float, float]
    source: Annotated[str, Field(description="from where it is known: an option, a format, a run, a recording")]


class Summary(Part):
    """A comparison."""

    schema_: Annotated[Literal["fgbaseline/comparison/1"], Field(alias="schema")] = SCHEMA
    caption: str
    reference: ReferenceSummary
    estimates: dict[str, EstimateSummary]
    up: Up
    sequence: Annotated[str | None, Field(description="the recording that the reprojection is of")]
    settings: dict[str, str | int | float | bool | None]
    versions: dict[str, str]


def json_schema() -> str:
    """The JSON schema of `comparison.json`, as text."""
    schema = Summary.model_json_schema(by_alias=True, mode="serialization")
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2)


if __name__ == "__main__":
    print(json_schema())
