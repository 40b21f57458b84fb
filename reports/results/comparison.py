"""Model of `comparison.json`; `make schema` writes docs/comparison.schema.json."""

from typing import Annotated, Any, Final, Literal

from pydantic import Field

from fgbaseline.reports.results.parts import Document, Nees, Number, Part, Reprojection

SCHEMA: Final = "fgbaseline/comparison/1"
"""raised when a key is renamed, removed or changes its meaning; new keys do not raise it"""


class Statistic(Part):
    """A value with its 95 % confidence interval by a block bootstrap, which respects correlation in time."""

    value: Number
    low: Number
    high: Number


class Statistics(Part):
    """Statistics of errors in order of time."""

    rmse: Statistic
    mean: Statistic
    median: Statistic
    std: Statistic
    p95: Statistic
    min: Number
    max: Number
    sse: Annotated[Number, Field(description="sum of squares")]
    n: int
    missing: Annotated[int, Field(description="NaN errors, which the values leave out")]
    block: Annotated[int, Field(description="block length of the bootstrap, errors")]
    reliable: Annotated[bool, Field(description="whether at least ten blocks fit into the trajectory")]


class Pairing(Part):
    """Association of the poses."""

    pairs: int
    association: Literal["nearest", "interpolated"]
    tolerance_s: float
    offset_s: Annotated[float, Field(description="added to the estimate's stamps")]
    offset_range_s: Annotated[
        tuple[float, float] | None, Field(description="offsets that fit nearly as well; null without a search")
    ]
    offset_determined: Annotated[bool | None, Field(description="null without a search")]
    left_out_reference: int
    left_out_estimate: int


class AlignmentSummary(Part):
    """p -> scale * rotation @ p + translation, applied to the estimate."""

    kind: Literal["none", "first-pose", "yaw", "se3", "sim3"]
    rotation: list[list[float]]
    translation: list[float]
    scale: float
    poses: Annotated[int, Field(description="pairs that it is estimated from")]
    free: Annotated[list[str], Field(description="degrees of freedom that positions do not determine")]


class Relative(Part):
    """Errors of relative motions over a delta."""

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
    official: Annotated[bool, Field(description="KITTI's own lengths and step: comparable with published values")]
    by_length: list[SegmentsOfLength]
    intervals: Annotated[dict[str, Statistic], Field(description="of both means, by name")]


class Rate(Statistic):
    """A drift."""

    unit: str
    over: str
    n: int


class Consistency(Nees):
    """Normalized estimation error squared of the poses by the reported covariances."""

    not_positive_definite: Annotated[int, Field(description="covariances that are not, which are left out")]


class Common(Part):
    """Position error over the stamps that all ranked estimates have."""

    moments: int
    rmse: Annotated[Statistic, Field(description="m; the ranks are by this")]


class Behind(Statistic):
    """RMSE of the positions above that of the nearest estimate, with a paired block bootstrap."""

    block: int
    blocks: Annotated[Number, Field(description="number of blocks that fit into the series")]
    reliable: bool


class MapOfDepth(Part):
    """Medians of one depth class, m."""

    depth: str
    n: int
    distance: Number
    seen: Number


class MapDifference(Part):
    """Differences of landmarks of equal index from the reference's, aligned as the path is."""

    n: int
    median: Annotated[Number, Field(description="m, in the world")]
    p95: Number
    median_seen: Annotated[Number, Field(description="m, each in the frame of its own camera: without drift")]
    by_depth: list[MapOfDepth]


class HeldOutFigures(Part):
    """Errors on held-out tracks, px, over the same observations for all."""

    median: Statistic
    behind: Annotated[Statistic, Field(description="median above the best one")]
    p95: Number
    under_3px: Number


class Shares(Part):
    """Shares of the sum of squared position differences, which add to one."""

    scale: Number
    heading: Number
    noise: Number
    scale_percent: Number
    heading_deg: Number
    heading_deg_per_s: Annotated[Number, Field(description="per pose without stamps")]
    intervals: Annotated[dict[str, Statistic], Field(description="of the three shares")]
    reliable: bool


class Passing(Part):
    """First pose whose position difference is beyond a bound."""

    bound_m: float
    t: Number
    traveled_m: Number


class EstimateSummary(Part):
    """Values of one estimate."""

    source: str
    poses: int
    coverage: Annotated[Number, Field(description="share of the reference's time in which there are paired poses")]
    rank: Annotated[
        int | None,
        Field(description="1 for the nearest over the common stamps; null for by-products and for too few stamps"),
    ]
    caption: Annotated[str, Field(description="association and alignment, in words")]
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
        Consistency | None,
        Field(description="of its own covariances, against a reference that is taken for ground truth"),
    ]
    shares: Shares
    common: Annotated[Common | None, Field(description="null where there is no such stamp, or it has too few")]
    behind: Annotated[Behind | None, Field(description="null for the nearest, and for by-products of the reference")]
    final_m: Number
    passing: Passing
    reprojection: Annotated[Reprojection | None, Field(description="over all observations of its own landmarks")]
    reprojection_common: Annotated[
        Reprojection | None, Field(description="over those of the problem that all have landmarks for")
    ]
    reprojection_along: Annotated[
        Reprojection | None, Field(description="with landmarks triangulated along its trajectory")
    ]
    map: MapDifference | None
    held_out: HeldOutFigures | None
    samples: Annotated[
        dict[str, dict[str, float]],
        Field(description="by the beginning of a metric's key path: sample size n, coverage of the estimate's time"),
    ]
    notes: Annotated[dict[str, str], Field(description="why a value is null or missing, by key")]


class ReferenceSummary(Part):
    """The reference."""

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
    source: Annotated[str, Field(description="its source: an option, a file, a format, a run, a recording, or assumed")]


class Summary(Document):
    """A comparison."""

    schema_: Annotated[Literal["fgbaseline/comparison/1"], Field(alias="schema")] = SCHEMA
    caption: str
    reference: ReferenceSummary
    estimates: dict[str, EstimateSummary]
    up: Up
    sequence: Annotated[str | None, Field(description="the recording that the reprojection is of")]
    settings: dict[str, str | int | float | bool | None]
    versions: dict[str, str]

    @property
    def by_name(self) -> dict[str, dict[str, Any]]:
        """Values of the reference and of every estimate, as JSON has them."""
        parts = {self.reference.name: self.reference, **self.estimates}
        return {name: part.model_dump(mode="json") for name, part in parts.items()}


if __name__ == "__main__":
    print(Summary.json_schema())
