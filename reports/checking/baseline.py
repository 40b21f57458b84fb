"""The baseline: the guarded figures of the run that was last accepted."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fgbaseline.compare.limits import Outcome, rounded
from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.formats.named_file import shown
from fgbaseline.geometry import InputError

from ..results.check import Checked, Line
from ..results.reader import BASELINE, DIGITS, Measured, MeasuredRun, failure, read_measured, value_of

TIMINGS = frozenset({"seconds", "frames_per_second", "memory", "peak_memory"})
"""parts of metrics that depend on the machine"""


def is_timing(metric: str) -> bool:
    """Whether a metric says more of the machine than of the estimate."""
    return any(part in TIMINGS or part.startswith("peak_memory") for part in metric.split("."))


def before(
    baseline: Measured | None, name: str, run: MeasuredRun, estimator: str, metric: str
) -> tuple[float | None, str]:
    """The baseline's value, rounded, or None and why it has none that this run could be held against."""
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
            return None, f"the baseline diverges from {old.reference.name}, this run from {run.reference.name}"
    values = old.estimators[estimator]
    value, reason = value_of(values, metric)
    if value is None:
        return None, f"the baseline has no value: {reason}" if failure(values) else f"the baseline has no {metric}"
    return rounded(value, DIGITS), ""


def require_replaceable(path: Path) -> Measured | None:
    """The old baseline, None where there is none yet. Raises InputError where the file is no baseline."""
    if not path.exists():
        return None
    old = read_measured(path)
    if old.schema != BASELINE:
        raise InputError(
            f"{shown(path)}: this is no baseline but a {old.schema}, which is not overwritten; name another file"
        )
    return old


def updated(checked: Checked) -> str:
    """The text of the new baseline: every figure that a limit guards, timings apart, sorted and rounded.

    Raises InputError for a figure that is none.
    """
    runs: dict[str, Any] = {}
    for line in _guarded(checked.lines):
        if line.value is None:
            raise InputError(
                f"{line.estimator} has no {line.metric} to put into a baseline: {line.reason}; "
                "mend it, or take it out of the limits"
            )
        if line.run not in runs:
            reference = checked.measured.runs[line.run].reference
            runs[line.run] = {"estimators": {}, "sequence": {"name": line.run}}
            runs[line.run]["reference"] = {"name": reference.name, "trust": reference.trust}
        _put(runs[line.run]["estimators"].setdefault(line.estimator, {}), line.metric, rounded(line.value, DIGITS))
    document = {"schema": BASELINE, "runs": runs}
    return json.dumps(document, indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n"


def refusal(checked: Checked, path: Path) -> str:
    """Why the baseline stays as it is, in a sentence."""
    short = checked.count[Outcome.FALLS_SHORT]
    if short:
        why = f"{short} of {len(checked.lines)} limits {'falls' if short == 1 else 'fall'} short"
        return f"{shown(path)}: not written, since {why}; mend that, or accept it with --accept-worse"
    if checked.shortages:
        return f"{shown(path)}: not written. {checked.shortages[0]}"
    return f"{shown(path)}: not written, since the reference is not trusted enough; see what the run says of it"


def write_baseline(checked: Checked, path: Path) -> str:
    """Writes the new baseline whole, and says so. Raises InputError where a reference or a figure is not fit for it."""
    if checked.shortages:
        raise InputError(f"{shown(path)}: not written. {checked.shortages[0]}")
    if checked.undecided or checked.count[Outcome.CANNOT_TELL]:
        raise InputError(
            f"{shown(path)}: not written, since the reference is not trusted enough; see what the run says of it"
        )
    text = updated(checked)
    same = path.is_file() and path.read_bytes() == text.encode()
    if not same:
        with atomic_write(path) as file:
            file.write(text.encode())
    return f"The baseline {shown(path)} is {'as it was' if same else 'written'}."


def _guarded(lines: Iterable[Line]) -> Iterable[Line]:
    return (line for line in lines if not is_timing(line.metric))


def _put(values: dict[str, Any], metric: str, value: float) -> None:
    *above, last = metric.split(".")
    for part in above:
        values = values.setdefault(part, {})
    values[last] = value
