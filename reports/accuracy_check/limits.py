"""What a check holds metrics against: the limits file, in TOML, and the accuracy baseline.

The baseline is a JSON file with the metrics of the last accepted run that limits are on.
"""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE
from fgbaseline.compare.acceptance_limits import Better, Bounds, Outcome, rounded
from fgbaseline.data.formats.files.atomic_write import atomic_write
from fgbaseline.data.formats.files.file_errors import shown
from fgbaseline.data.formats.files.toml_file import TomlFile, read_toml
from fgbaseline.geometry import InputError

from ..phrases.check import violated_limits
from ..results.check import Checked
from ..results.parts import Finite, Part
from ..results.reader import BASELINE, DIGITS, Measured, MeasuredRun, failure, read_measured, value_of

TIMINGS = frozenset({"seconds", "frames_per_second", "memory", "peak_memory"})
"""parts of the metrics that depend on the machine"""
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


def is_timing(metric: str) -> bool:
    """Whether a metric measures the machine: time or memory."""
    return any(part in TIMINGS or part.startswith("peak_memory") for part in metric.split("."))


def baseline_value(
    baseline: Measured | None, name: str, run: MeasuredRun, estimator: str, metric: str
) -> tuple[float | None, str]:
    """The baseline's value, rounded, or None and why it has none to compare this run with."""
    if baseline is None:
        return None, "there is no baseline"
    old = baseline.runs.get(name)
    if old is None:
        return None, f"the baseline has no run '{name}'; it has {', '.join(map(repr, baseline.runs))}"
    if estimator not in old.estimators:
        return None, f"the baseline has no {estimator}"
    if run.rests_on_reference(metric):
        if old.reference.trust == "untrusted":
            return None, f"the reference of the baseline, {old.reference.name}, was untrusted"
        if old.reference.name != run.reference.name:
            return None, f"the reference of the baseline is {old.reference.name}, that of this run {run.reference.name}"
    values = old.estimators[estimator]
    value, reason = value_of(values, metric)
    if value is None:
        return None, f"the baseline has no value: {reason}" if failure(values) else f"the baseline has no {metric}"
    return rounded(value, DIGITS), ""


def require_replaceable(path: Path) -> Measured | None:
    """Reads the old baseline; None where there is none yet. Raises InputError where the file is not a baseline."""
    if not path.exists():
        return None
    old = read_measured(path)
    if old.schema != BASELINE:
        raise InputError(
            f"{shown(path)}: this is not a baseline but {old.schema}, which is not overwritten; name another file"
        )
    return old


def new_baseline(checked: Checked) -> str:
    """The text of the new baseline: every metric with a limit except timings, sorted and rounded.

    Raises InputError for a metric without a value.
    """
    runs: dict[str, Any] = {}
    for line in checked.lines:
        if is_timing(line.metric):
            continue
        if line.value is None:
            raise InputError(
                f"{line.estimator} has no {line.metric} for the baseline: {line.reason}; "
                "correct it, or remove it from the limits"
            )
        if line.run not in runs:
            reference = checked.measured.runs[line.run].reference.model_dump(include={"name", "trust"})
            runs[line.run] = {"estimators": {}, "sequence": {"name": line.run}, "reference": reference}
        values = runs[line.run]["estimators"].setdefault(line.estimator, {})
        *above, last = line.metric.split(".")
        for part in above:
            values = values.setdefault(part, {})
        values[last] = rounded(line.value, DIGITS)
    document = {"schema": BASELINE, "runs": runs}
    return json.dumps(document, indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n"


def refusal(checked: Checked, path: Path, *, accepted: bool = False) -> str:
    """Why the baseline is not written, in a sentence; `accepted` disregards violated limits."""
    if checked.count[Outcome.VIOLATED] and not accepted:
        return f"{shown(path)}: not written, since {violated_limits(checked)}; correct that, or use --accept-worse"
    if checked.shortages:
        return f"{shown(path)}: not written. {checked.shortages[0]}"
    why = "the reference is not trusted enough; the run's report has the reasons"
    if not checked.undecided:
        line = next(line for line in checked.lines if line.outcome is Outcome.UNDECIDED)
        why = f"{line.metric} of {line.estimator} is undecided: {line.reason}"
    return f"{shown(path)}: not written, since {why}"


def write_baseline(checked: Checked, path: Path) -> str:
    """Writes the new baseline atomically and returns a sentence on it.

    Raises InputError where a sample is too small, a reference is not trusted enough, or a limit is undecided.
    """
    if checked.shortages or checked.undecided or checked.count[Outcome.UNDECIDED]:
        raise InputError(refusal(checked, path, accepted=True))
    text = new_baseline(checked)
    same = path.is_file() and path.read_bytes() == text.encode()
    if not same:
        with atomic_write(path) as file:
            file.write(text.encode())
    return f"The baseline {shown(path)} is {'unchanged' if same else 'written'}."
