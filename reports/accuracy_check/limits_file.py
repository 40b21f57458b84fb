"""The limits file, in TOML."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE
from fgbaseline.compare.acceptance_limits import Better, Bounds
from fgbaseline.data.toml_file import TomlFile, read_toml

from ..results.parts import Finite, Part

NotNegative = Annotated[float, Field(allow_inf_nan=False, ge=0)]
Count = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(allow_inf_nan=False, ge=0, le=1)]


class Needed(StrEnum):
    """Trust in the reference that a limit requires to hold."""

    TRUSTED = "trusted"
    DOUBTFUL = "doubtful"
    """a doubtful one suffices, and is reported"""
    NONE = "none"
    """any, for metrics that do not depend on the reference; the others require a doubtful one"""


class Tolerance(Part):
    """Allowed change of a metric for the worse: the larger of the two."""

    better: Better
    relative: NotNegative = 0.0
    """share of the baseline"""
    absolute: NotNegative = 0.0
    """in the metric's unit"""

    @property
    def text(self) -> str:
        """Tolerance as text, such as `5 % or 0.01`."""
        parts = [f"{100 * self.relative:.4g} %"] if self.relative else []
        parts += [f"{self.absolute:.4g}"] if self.absolute else []
        return " or ".join(parts) or "nothing"


def _no_blank(text: str) -> str:
    if not text.strip():
        raise ValueError("it is empty; write a path or a pattern")
    return text


Pattern = Annotated[str, AfterValidator(_no_blank)]


class Limit(Part):
    """A limit on a metric of every estimator and run that the patterns match."""

    metric: Pattern
    """key path of the metric below `estimators.NAME` in summary.json, such as ate.rmse"""
    estimators: Pattern | Annotated[tuple[Pattern, ...], Field(min_length=1)] = "*"
    runs: Pattern = "*"
    """pattern, for a folder with several runs"""
    at_most: Finite | None = None
    at_least: Finite | None = None
    baseline: Tolerance | None = None
    smallest_sample: Count | None = None
    """smallest number of samples for a verdict; None for that of the file"""
    smallest_coverage: Share | None = None
    within_reference_sigma: bool = False
    """whether a bound on the divergence below the reference's own sigma leaves the limit undecided"""

    @property
    def patterns(self) -> tuple[str, ...]:
        """The patterns of estimators, one or several."""
        return (self.estimators,) if isinstance(self.estimators, str) else self.estimators

    @property
    def bounds(self) -> Bounds | None:
        """The limit's own bounds; None where it has only a baseline."""
        given = {side: value for side in ("at_most", "at_least") if (value := getattr(self, side)) is not None}
        return Bounds(**given) if given else None

    @model_validator(mode="after")
    def _says_something(self) -> "Limit":
        if self.bounds is None and self.baseline is None:
            raise ValueError(f"{self.metric} has no bound; add at_most, at_least or baseline")
        if self.bounds is not None and self.bounds.at_least > self.bounds.at_most:
            raise ValueError(f"at_least = {self.at_least:g} is above at_most = {self.at_most:g}; nothing lies between")
        if self.within_reference_sigma and (self.at_most is None or not self.metric.startswith("divergence")):
            raise ValueError("within_reference_sigma applies to at_most of divergence.*; leave it out here")
        return self


class Limits(Part):
    """The file."""

    reference: Needed = Needed.DOUBTFUL
    smallest_sample: Count = MIN_SAMPLE_SIZE
    """number of poses, frames or observations behind a metric"""
    smallest_coverage: Share = MIN_COVERAGE
    """share of the time of the estimate; in a run, of the recording"""
    limit: Annotated[tuple[Limit, ...], Field(min_length=1)]


def read_limits(path: Path, values: dict[str, Any] | None = None) -> TomlFile[Limits]:
    """The limits of a file, from its `values` if these are read already.

    Raises InputError with the file, the key path and the allowed values.
    """
    return read_toml(path, Limits, values)
