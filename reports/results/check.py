"""A folder held against its limits: a line for each limit and estimator, and the exit code."""

from collections.abc import Mapping
from dataclasses import dataclass

from fgbaseline.compare.acceptance_limits import Bounds, Outcome, rounded

from .reader import DIGITS, Measured

HOLDS, VIOLATED, UNDECIDED = 0, 1, 2
"""exit codes"""
NEW = "new in the baseline"
"""the reason of a line that had nothing to be held against, and is about to get it"""


@dataclass(frozen=True, slots=True)
class Shortage:
    """A sample that is too small to judge by."""

    n: int
    coverage: float | None
    """share of the time; None for what is not spread over time"""
    smallest: int
    smallest_coverage: float

    @property
    def reason(self) -> str:
        """Size of the sample, and the required one."""
        there, asked = f"{self.n}", f"{self.smallest}"
        if self.coverage is not None:
            there += f" over {100.0 * self.coverage:.3g} % of the time"
            asked += f" over {100.0 * self.smallest_coverage:.3g} %"
        return f"it has a sample of {there}, {asked} are asked for"


@dataclass(frozen=True, slots=True)
class Line:
    """A metric of an estimator against one limit."""

    run: str
    """the name of the sequence; empty where trajectories alone were compared"""
    estimator: str
    metric: str
    limit: str
    """key path in the limits file: `limit[3]`"""
    outcome: Outcome
    value: float | None
    bounds: Bounds | None
    """None where there is no baseline to take them from"""
    tolerance: str
    """allowance on the baseline, such as '5 %'; empty for bounds that are written down"""
    before: float | None
    """in the baseline"""
    reason: str
    """why there is no value, or why the limit cannot be judged"""
    missing: int = 0
    """number of NaN errors, which the value does not include"""
    shortage: Shortage | None = None
    """None where its sample is large enough"""

    @property
    def margin(self) -> float | None:
        """Margin of the value inside its bounds; negative outside."""
        return None if self.value is None or self.bounds is None else self.bounds.margin(self.value)

    @property
    def change(self) -> float | None:
        """The value, rounded as the baseline is, minus that of the baseline."""
        if self.value is None or self.before is None:
            return None
        return rounded(rounded(self.value, DIGITS) - self.before, DIGITS)


@dataclass(frozen=True, slots=True)
class Checked:
    """A folder held against its limits."""

    lines: tuple[Line, ...]
    """in the order of the limits file, then of run and estimator"""
    references: tuple[str, ...]
    """sentences on references that are not trusted, one for each run"""
    sigmas: tuple[str, ...]
    """sentences on the sigma of the references themselves"""
    shortages: tuple[str, ...]
    """sentences on samples that are smaller than the limits ask for, printed first"""
    undecided: bool
    """a reference is less trusted than the limits ask for"""
    measured: Measured
    limits: str
    """the limits file"""
    baseline: str | None

    @property
    def notices(self) -> tuple[str, ...]:
        """Sentences before the table: too small samples, untrusted references and the sigma of references."""
        return (*self.shortages, *self.references, *self.sigmas)

    @property
    def exit_code(self) -> int:
        """0 all hold, 1 some are violated, 2 none is but some are undecided."""
        if self.count[Outcome.VIOLATED]:
            return VIOLATED
        return UNDECIDED if self.undecided or self.count[Outcome.UNDECIDED] else HOLDS

    @property
    def count(self) -> Mapping[Outcome, int]:
        """Number of lines by outcome."""
        return {outcome: sum(line.outcome is outcome for line in self.lines) for outcome in Outcome}
