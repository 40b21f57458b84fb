"""Evaluation of every limit on every estimator that it matches."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

from fgbaseline.compare import MIN_STRETCHES, is_insufficient
from fgbaseline.compare.acceptance_limits import Bounds, Outcome, around, rounded
from fgbaseline.data.formats.files.file_errors import shown
from fgbaseline.data.formats.files.toml_file import TomlFile

from ..formatting import number
from ..phrases.check import too_little_data, untrusted_reference
from ..phrases.evidence import reference_sigma_sentence
from ..results.check import NEW, Checked, Line, Shortage
from ..results.json_files import INFINITE
from ..results.reader import (
    DIGITS,
    NO_SUCH_METRIC,
    Measured,
    MeasuredRun,
    failure,
    has_metric,
    metrics_of,
    missing_in,
    nearest,
    sample_of,
    value_of,
)
from .limits import Limit, Limits, Needed, baseline_value, is_timing


def evaluate(
    limits: TomlFile[Limits], measured: Measured, baseline: Measured | None, *, updating: bool = False
) -> Checked:
    """Evaluates all limits on the measured metrics and on a baseline.

    With `updating`, a metric that the baseline lacks holds as new; otherwise it is undecided. Raises InputError with
    the key path for a limit that matches nothing, and for one on a baseline that does not exist.
    """
    lines: list[Line] = []
    for index, limit in enumerate(limits.content.limit):
        _require_baseline(limits, index, limit, given=baseline is not None or updating)
        for name, estimator in matching(limits, index, measured):
            lines += _lines(limits, index, name, measured.runs[name], estimator, baseline, updating)
    needed = limits.content.reference
    several = len(measured.runs) > 1
    named = [(name if several else "", run.reference) for name, run in measured.runs.items()]
    return Checked(
        lines=tuple(lines),
        references=tuple(untrusted_reference(*each) for each in named if each[1].trust not in (None, "trusted")),
        sigmas=tuple(
            f"{f'{name}: ' if name else ''}{reference_sigma_sentence(reference.name, reference.sigma.model_dump())}"
            for name, reference in named
            if reference.sigma is not None and reference.name is not None
        ),
        shortages=too_little_data([replace(line, run=line.run if several else "") for line in lines]),
        undecided=needed is not Needed.NONE and any(is_undertrusted(run, needed) for run in measured.runs.values()),
        measured=measured,
        limits=shown(limits.path),
        baseline=None if baseline is None else shown(baseline.path),
    )


def matching(limits: TomlFile[Limits], index: int, measured: Measured) -> list[tuple[str, str]]:
    """Runs and estimators that a limit matches, by name. Raises InputError where a pattern of it matches nothing."""
    limit = limits.content.limit[index]
    runs = {name: run for name, run in measured.runs.items() if fnmatchcase(name, limit.runs)}
    if not runs:
        reason = f'runs = "{limit.runs}" matches no run in {shown(measured.path)}; there are {", ".join(measured.runs)}'
        raise limits.wrong(("limit", index, "runs"), reason)
    there = sorted({name for run in runs.values() for name in run.estimators})
    for pattern in limit.patterns:
        if not any(fnmatchcase(name, pattern) for name in there):
            reason = f'estimators = "{pattern}" matches no estimator; there are {", ".join(there)}'
            raise limits.wrong(("limit", index, "estimators"), reason)
    chosen = {
        (name, estimator): values
        for name, run in runs.items()
        for estimator, values in run.estimators.items()
        if any(fnmatchcase(estimator, pattern) for pattern in limit.patterns)
    }
    if not any(failure(values) or has_metric(values, limit.metric) for values in chosen.values()):
        known = sorted({metric for values in chosen.values() for metric in metrics_of(values)})
        reason = f'metric = "{limit.metric}" is not a number of any matching estimator; there are '
        raise limits.wrong(("limit", index, "metric"), reason + nearest(limit.metric, known))
    return list(chosen)


def is_undertrusted(run: MeasuredRun, needed: Needed) -> bool:
    """Whether a run's reference is less trusted than needed; one without a trust is the user's own."""
    trust = run.reference.trust
    return trust == "untrusted" or (trust == "doubtful" and needed is Needed.TRUSTED)


def _lines(
    limits: TomlFile[Limits],
    index: int,
    name: str,
    run: MeasuredRun,
    estimator: str,
    baseline: Measured | None,
    updating: bool,
) -> Iterator[Line]:
    """One line for the limit's own bounds, and one for the bounds around the baseline."""
    limit, values = limits.content.limit[index], run.estimators[estimator]
    value, missing = value_of(values, limit.metric)
    old, unknown = baseline_value(baseline, name, run, estimator, limit.metric)
    shortage = _shortage(limits.content, limit, values)
    doubt = shortage.reason if shortage else _doubt(limit, run, limits.content.reference)
    left_out, place = missing_in(values, limit.metric), f"limit[{index}]"

    def line(value: float | None, bounds: Bounds | None, tolerance: str) -> Line:
        outcome, reason = Outcome.UNDECIDED, doubt or unknown
        if value is None:
            is_fault = failure(values) is not None or missing in (INFINITE, NO_SUCH_METRIC)
            outcome, reason = Outcome.VIOLATED if is_fault else Outcome.UNDECIDED, missing
        elif not doubt and bounds is not None:
            outcome, reason = bounds.judge(value), ""
        elif not doubt and updating:
            outcome, reason = Outcome.HOLDS, NEW
        return Line(
            name, estimator, limit.metric, place, outcome, value, bounds, tolerance, old, reason, left_out, shortage
        )

    if limit.bounds is not None:
        yield line(value, limit.bounds, "")
    if limit.baseline is not None:
        by = limit.baseline
        bounds = None if old is None else around(old, by.better, relative=by.relative, absolute=by.absolute)
        yield line(None if value is None else rounded(value, DIGITS), bounds, by.text)


def _doubt(limit: Limit, run: MeasuredRun, needed: Needed) -> str:
    """Why a limit is undecided: guessed units, the reference or its sigma; empty where none of them applies."""
    if run.guessed_units:
        return (
            f"the units of the recording ({', '.join(run.guessed_units)}) were estimated from its data; specify them "
            "with run --time-unit, or with a table [units] in --repairs"
        )
    if run.rests_on_reference(limit.metric) and is_undertrusted(run, needed):
        return f"the reference is {run.reference.trust}"
    if not limit.within_reference_sigma or limit.at_most is None:
        return ""
    sigma = None if run.reference.sigma is None else run.reference.sigma.of(limit.metric)
    if sigma is None:
        return "the sigma of the reference is unknown (within_reference_sigma)"
    if limit.at_most >= sigma:
        return ""
    unit = "°" if "rotation" in limit.metric else " m"
    return f"the limit is below the sigma of the reference, {number(sigma)}{unit} (within_reference_sigma)"


def _shortage(limits: Limits, limit: Limit, values: Mapping[str, Any]) -> Shortage | None:
    """The shortage of a metric's sample; None where it is large enough, or the metric has no sample."""
    sample = sample_of(values, limit.metric)
    smallest = limit.smallest_sample or limits.smallest_sample
    coverage = limits.smallest_coverage if limit.smallest_coverage is None else limit.smallest_coverage
    if sample is None or not is_insufficient(sample, smallest, coverage):
        return None
    n, stretches = int(sample["n"]), int(sample.get("stretches", MIN_STRETCHES))
    if n >= smallest and stretches < MIN_STRETCHES:
        n, smallest = stretches, MIN_STRETCHES
    return Shortage(n, sample.get("coverage"), smallest, coverage)


def _require_baseline(limits: TomlFile[Limits], index: int, limit: Limit, *, given: bool) -> None:
    if limit.baseline is None:
        return
    place = ("limit", index, "baseline")
    if is_timing(limit.metric):
        raise limits.wrong(place, f"a baseline has no timings such as {limit.metric}; use at_most")
    if not given:
        raise limits.wrong(place, "this limit needs a baseline; name one with --baseline FILE")
