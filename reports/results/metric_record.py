"""Record of a metric: its place in the results, its headings, unit, direction and tables."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Flag, auto
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple

from fgbaseline.compare.acceptance_limits import Better

from ..formatting import RESOLUTION, interval, number, resolved
from .glossary import TERMS
from .json_files import at

if TYPE_CHECKING:
    from fgbaseline.compare.estimate_comparison import Result, Run


class Value(NamedTuple):
    """Value with its 95 % interval; NaN for a missing value or bound."""

    value: float
    low: float = nan
    high: float = nan

    @property
    def text(self) -> str:
        """Text `0.52 [0.41, 0.66]`; the value alone without an interval, a dash for NaN."""
        return interval(self.value, self.low, self.high)

    def __bool__(self) -> bool:
        """Whether there is a finite value."""
        return isfinite(self.value)


class Tables(Flag):
    """Tables that a metric is a column of."""

    MAIN = auto()
    """main table of a run's page"""
    EVIDENCE = auto()
    """table below the charts of a run's page"""
    TERMINAL = auto()
    """table of a run on the terminal"""
    BENCH = auto()
    COMPARISON = auto()


NONE = Tables(0)
MAIN, EVIDENCE, TERMINAL, BENCH, COMPARISON = Tables


@dataclass(frozen=True, slots=True)
class Metric:
    """A metric of an estimator, with one name, unit and direction everywhere."""

    path: tuple[str, ...]
    """keys below the estimator; `DELTA` stands for each delta of a relative error"""
    group: str
    """quantity, the heading above its columns"""
    title: str
    """statistic, the heading of its column"""
    unit: str = ""
    better: Better = Better.NEITHER
    tables: Tables = NONE
    scale: float = 1.0
    """value in a table over that in the results"""
    term: str = ""
    """term of the glossary; empty: the group"""
    brief: str = ""
    """heading on the terminal and in a bench; empty: the group"""
    name: str = ""
    """column in the CSV files of a bench; empty: the bench leaves the metric out"""
    ranked: bool = False
    """whether a bench ranks estimators by the metric, which then measures accuracy"""
    same_data: bool = False
    """whether all estimators are measured on the same data, so that the best one may be marked at any coverage"""
    uneven_only: bool = False
    """whether a run's table has the metric only if the estimators cover different frames"""
    nonzero_only: bool = False
    """whether a run's table has the metric only if it is not 0 for all estimators"""
    count: bool = False
    """whether the value is an integer"""
    measure: "Callable[[Run, Result], float] | None" = None
    """computes the value of a metric that is not a field of the result models"""
    absent: str = ""
    """reason to state where the value is missing"""

    @property
    def key(self) -> str:
        """Name in `metrics.csv` and limits: the path."""
        return ".".join(self.path)

    @property
    def short(self) -> str:
        """Heading without a group above it."""
        return self.brief or self.group

    @property
    def glossary_term(self) -> str:
        """Term of the glossary that defines the metric; empty if there is none."""
        term = self.term or self.group
        return term if term in TERMS else ""

    @property
    def full_title(self) -> str:
        """Group, title and unit."""
        return f"{self.group}: {self.title}, {self.unit}" if self.unit else f"{self.group}: {self.title}"

    @property
    def heading(self) -> str:
        """Short title and unit."""
        return f"{self.short}, {self.unit}" if self.unit else self.short

    def text(self, value: float, resolution: float = RESOLUTION) -> str:
        """Value as text without unit; `< resolution` for rounding error."""
        if self.is_rounding(value, resolution):
            return resolved(value, resolution)
        return number(int(value) if self.count and isfinite(value) else value)

    def is_rounding(self, value: float, resolution: float = RESOLUTION) -> bool:
        """Whether a value in m, ° or without a unit is above zero, but below the resolution, hence rounding error.

        A ratio of sigmas is exempt: a small one means that the estimator is overconfident.
        """
        return self.unit in ("m", "°", "") and self.term != "sigma ratio" and 0.0 < abs(value) < resolution

    def value(self, results: Mapping[str, Any]) -> Value:
        """Value, with its interval, in the results of one estimator, in the unit of the tables."""
        return Value(*(self.scale * part for part in value_at(results, *self.path)))


def value_at(results: Mapping[str, Any], *path: str) -> Value:
    """Value at a key path of results: of a number, or of a mapping with `value`, `low` and `high`; NaN if missing."""
    found = at(results, *path)
    parts = [found.get(key) for key in Value._fields] if isinstance(found, Mapping) else [found]
    return Value(*map(_float, parts))


def _float(value: object) -> float:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else nan
