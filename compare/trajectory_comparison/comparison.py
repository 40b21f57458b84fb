"""Results of a comparison as plain data, from which tables, sentences, figures and files are made."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fgbaseline.compare.column_tables import Columns
from fgbaseline.compare.statistics.block_bootstrap import ErrorStatistics
from fgbaseline.compare.statistics.paired_bootstrap import RmseDifference
from fgbaseline.compare.trajectory.association import MatchedTrajectories
from fgbaseline.compare.trajectory.drift import Rate
from fgbaseline.compare.trajectory.error_decomposition import ErrorDecomposition, ShareIntervals
from fgbaseline.compare.trajectory.pose_errors import Exceedance
from fgbaseline.compare.trajectory.segments import SegmentErrors
from fgbaseline.compare.trajectory.time_offset import TimeOffset
from fgbaseline.compare.trajectory_comparison.inputs import Entry
from fgbaseline.compare.trajectory_comparison.ranking import Ranking
from fgbaseline.compare.trajectory_comparison.settings import Settings
from fgbaseline.data.display import Displayed
from fgbaseline.geometry import FloatArray

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.trajectory_comparison.reported_covariance import ReportedCovariance
    from fgbaseline.compare.trajectory_comparison.reprojection import Pixels
    from fgbaseline.data import Sequence


ASSUMED_UP = "assumed"
"""source of the up direction where no option, file, run or recording gives one"""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Result(Displayed):
    """Metrics of one estimate against the reference."""

    entry: Entry
    matched: MatchedTrajectories
    """pairs of poses, with the estimate aligned"""
    offset: TimeOffset | None
    """estimated time offset; None without a search"""
    absolute: Columns
    """see `compare.absolute_errors`"""
    divergence: Columns
    """see `compare.divergence_along_path`: along, across, up and heading over the distance traveled"""
    relative: dict[str, Columns]
    """relative errors by delta, such as `10 m`, of deltas not longer than the path: see `compare.relative_errors`"""
    segments: SegmentErrors | None
    drift: Mapping[str, Rate] | None
    """see `compare.drift`"""
    shares: ErrorDecomposition
    share_intervals: ShareIntervals
    bound: float
    """divergence threshold, m: 1 % of the path, at most 5 m"""
    passing: Exceedance | None
    """first pose whose position error exceeds `bound`; None without, or if the trajectories do not start together"""
    statistics: dict[str, ErrorStatistics]
    """statistics of the absolute errors `translation`, `rotation_deg` and `pose`"""
    relative_statistics: dict[str, dict[str, ErrorStatistics]]
    """statistics by delta, then `translation` and `rotation_deg`"""
    reported_covariance: "ReportedCovariance | None"
    """consistency of the covariances that the estimate reports; None without covariances"""
    pixels: "Pixels | None"
    map: "pd.DataFrame | None"
    """see `compare.map_difference`; the landmarks are aligned as the path is"""
    resolution: dict[str, float]
    """smallest difference that the files resolve, by its unit, `m` and `°`"""
    notes: dict[str, str]
    """why values are missing, by key"""
    up_deviation: float | None = None
    """deg, angle between the file's stated up direction, after alignment, and that of the comparison"""

    @property
    def name(self) -> str:
        """Name in tables and figures."""
        return self.entry.name

    @property
    def rmse(self) -> float:
        """RMSE of the positions over all paired poses, m."""
        return float(self.statistics["translation"]["rmse"].value)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Comparison(Displayed):
    """Reference, and the metrics of every estimate against it."""

    reference: Entry
    reference_pixels: "Pixels | None"
    results: dict[str, Result]
    """results by name, in the order of the input"""
    up: FloatArray
    """(3,) unit vector that points up in the reference's world"""
    up_from: str
    """the source of `up`"""
    deltas: tuple[str, ...]
    settings: Settings
    ranking: Ranking
    held_out: "pd.DataFrame | None"
    """see `compare.held_out_ranking`: the reference among them"""
    sequence: "Sequence | None"
    """the recording whose observations are reprojected"""

    @property
    def behind(self) -> dict[str, RmseDifference]:
        """RMSE of each ranked estimate minus that of the first, which has no entry."""
        return self.ranking.behind

    @property
    def ranked(self) -> list[Result]:
        """Results by rank; those without a rank last, in the order of the input."""
        order = list(self.ranking.at)
        last = len(order)
        return sorted(self.results.values(), key=lambda r: order.index(r.name) if r.name in order else last)

    @property
    def pixels(self) -> "dict[str, Pixels]":
        """Reprojection errors of the trajectories that have them, the reference first."""
        every = {self.reference.name: self.reference_pixels}
        every |= {name: result.pixels for name, result in self.results.items()}
        return {name: pixels for name, pixels in every.items() if pixels is not None}
