"""The baseline: the metrics of the last accepted run that limits are on."""

import json
from pathlib import Path
from typing import Any

from fgbaseline.compare.acceptance_limits import Outcome, rounded
from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.formats.file_errors import shown
from fgbaseline.geometry import InputError

from ..phrases.check import violated_limits
from ..results.check import Checked
from ..results.reader import BASELINE, DIGITS, Measured, MeasuredRun, failure, read_measured, value_of

TIMINGS = frozenset({"seconds", "frames_per_second", "memory", "peak_memory"})
"""parts of the metrics that depend on the machine"""


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
            reference = checked.measured.runs[line.run].reference
            runs[line.run] = {"estimators": {}, "sequence": {"name": line.run}}
            runs[line.run]["reference"] = {"name": reference.name, "trust": reference.trust}
        _put(runs[line.run]["estimators"].setdefault(line.estimator, {}), line.metric, rounded(line.value, DIGITS))
    document = {"schema": BASELINE, "runs": runs}
    return json.dumps(document, indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n"


def refusal(checked: Checked, path: Path, *, accepted: bool = False) -> str:
    """Why the baseline is not written, in a sentence; `accepted` disregards violated limits."""
    if checked.count[Outcome.VIOLATED] and not accepted:
        return f"{shown(path)}: not written, since {violated_limits(checked)}; correct that, or use --accept-worse"
    if checked.shortages:
        return f"{shown(path)}: not written. {checked.shortages[0]}"
    if checked.undecided:
        return (
            f"{shown(path)}: not written, since the reference is not trusted enough; the run's report has the reasons"
        )
    line = next(line for line in checked.lines if line.outcome is Outcome.UNDECIDED)
    return f"{shown(path)}: not written, since {line.metric} of {line.estimator} is undecided: {line.reason}"


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


def _put(values: dict[str, Any], metric: str, value: float) -> None:
    *above, last = metric.split(".")
    for part in above:
        values = values.setdefault(part, {})
    values[last] = value
