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
    """A value, and its 95 % interval where it has one; NaN for what is missing."""

    value: float
    low: float = nan
    high: float = nan

    @property
    def text(self) -> str:
        """`0.52 [0.41, 0.66]`, the value alone, or a dash."""
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
    """term of the glossary, where it is not the group"""
    brief: str = ""
    """heading on the terminal and in a bench, where it is not the group"""
    name: str = ""
    """column of a bench's CSV tables; empty: none"""
    ranked: bool = False
    """whether a bench ranks by it: it measures accuracy"""
    same_data: bool = False
    """whether it is taken over the same data for all, so that it says which is best whatever each one covers"""
    uneven_only: bool = False
    """whether it stands in a run's table only where the estimators do not cover the same frames"""
    nonzero_only: bool = False
    """whether it stands in a run's table only where it is not 0 for all"""
    count: bool = False
    """whether it is a whole number"""
    measure: "Callable[[Run, Result], float] | None" = None
    """its value, where no model of the results has it"""
    absent: str = ""
    """why what it measures may be missing"""

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
        """Term of the glossary that explains it; empty where there is none."""
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
        """A value of it, without its unit; 0 with the resolution for rounding."""
        if self.is_rounding(value, resolution):
            return resolved(value, resolution)
        return number(int(value) if self.count and isfinite(value) else value)

    def is_rounding(self, value: float, resolution: float = RESOLUTION) -> bool:
        """Whether a distance, an angle or what is normalized is not zero, and too small to mean anything.

        A small ratio of sigmas means something: the estimator is overconfident.
        """
        return self.unit in ("m", "°", "") and self.term != "sigma ratio" and 0.0 < abs(value) < resolution

    def value(self, results: Mapping[str, Any]) -> Value:
        """Its value in the results of one estimator."""
        return Value(*(self.scale * part for part in value_at(results, *self.path)))


def value_at(results: Mapping[str, Any], *path: str) -> Value:
    """The number at a path, or the mapping there with `value`, `low` and `high`."""
    found = at(results, *path)
    parts = [found.get(key) for key in Value._fields] if isinstance(found, Mapping) else [found]
    return Value(*map(_float, parts))


def _float(value: object) -> float:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else nan
