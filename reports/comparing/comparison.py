"""Estimates against a reference: every table that the page, the figures and the files draw on."""

from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from fgbaseline.compare import DifferenceShares, Matched, Passing, RmseDifference, SegmentErrors, TimeOffset
from fgbaseline.geometry import FloatArray

from .claimed import Claimed
from .entry import Entry
from .pixels import Pixels
from .ranking import Ranking
from .settings import Settings


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """One estimate, compared."""

    entry: Entry
    matched: Matched
    """aligned"""
    offset: TimeOffset | None
    """where it was searched for"""
    absolute: pd.DataFrame
    """see `compare.absolute_errors`"""
    departure: pd.DataFrame
    """see `compare.growing_divergence`: along, across, up, heading, per metre travelled"""
    relative: dict[str, pd.DataFrame]
    """by delta, such as `10 m`: see `compare.relative_errors`; those that the path is too short for are missing"""
    segments: SegmentErrors | None
    drift: pd.DataFrame | None
    """see `compare.drift`"""
    shares: DifferenceShares
    share_intervals: pd.DataFrame
    """see `compare.share_intervals`"""
    bound: float
    """m: 1 % of the path, at most 5 m"""
    passing: Passing | None
    """where the position is first farther off than `bound`"""
    statistics: dict[str, pd.DataFrame]
    """of the absolute errors `translation`, `rotation_deg` and `pose`: see `compare.error_statistics`"""
    relative_statistics: dict[str, dict[str, pd.DataFrame]]
    """by delta, then `translation` and `rotation_deg`"""
    claimed: Claimed | None
    """its covariances beside its errors against the truth"""
    pixels: Pixels | None
    map: pd.DataFrame | None
    """see `compare.map_difference`; the landmarks are aligned as the path is"""
    notes: dict[str, str]
    """why something is missing"""

    @property
    def name(self) -> str:
        """What tables and figures call it."""
        return self.entry.name

    @property
    def rmse(self) -> float:
        """Of the positions over all of its own moments, m."""
        return float(self.statistics["translation"]["value"]["rmse"])


@dataclass(frozen=True, eq=False, slots=True)
class Comparison:
    """All there is to report: pandas tables, matplotlib figures, and a folder of everything."""

    reference: Entry
    reference_pixels: Pixels | None
    results: dict[str, Result]
    """by name, in the order given"""
    up: FloatArray
    """(3,) in the reference's world"""
    up_from: str
    """from where that is known"""
    deltas: tuple[str, ...]
    settings: Settings
    ranking: Ranking
    held_out: pd.DataFrame | None
    """see `compare.held_out_ranking`: the reference among them"""
    sequence: str | None
    """the recording that the reprojection is of"""

    @property
    def behind(self) -> dict[str, RmseDifference]:
        """By how much each estimate is farther from the reference than the nearest rival; that one is missing."""
        return self.ranking.behind

    @property
    def ranked(self) -> list[Result]:
        """Nearest to the reference first; what could not be ranked last, in the order given."""
        order = list(self.ranking.at)
        last = len(order)
        return sorted(self.results.values(), key=lambda r: order.index(r.name) if r.name in order else last)

    @property
    def table(self) -> pd.DataFrame:
        """One row per estimate, one column per main figure; see `caption`."""
        from .tables import main_table

        return main_table(self)

    @property
    def metrics(self) -> pd.DataFrame:
        """Every figure: estimate, metric, value, and low and high of its confidence interval."""
        from .tables import metrics_table

        return metrics_table(self)

    @property
    def caption(self) -> str:
        """What was paired and how it was aligned: a table without it says nothing."""
        from .wording import caption

        return caption(self)

    @property
    def verdict(self) -> list[str]:
        """What the numbers say, in sentences, the trust in the reference first."""
        from .wording import verdict

        return verdict(self)

    def figures(self) -> dict[str, Figure]:
        """The figures by name."""
        from ..figures.comparison import draw

        return draw(self)

    def write(self, folder: str | Path, *, force: bool = False) -> Path:
        """Tables, figures and report.html in a folder, all or nothing; gives the path of the report."""
        from .folder import write

        return write(self, Path(folder), force=force)
