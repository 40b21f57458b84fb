"""Evaluation: every limit against every estimator that it matches."""

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Any

from fgbaseline.compare import MIN_STRETCHES, is_insufficient
from fgbaseline.compare.limits import Bounds, Outcome, around, rounded
from fgbaseline.data.formats.named_file import shown
from fgbaseline.data.toml_file import TomlFile

from ..formatting import number
from ..phrases.evidence import reference_sigma_sentence
from ..results.check import NEW, Checked, Line, Shortage
from ..results.json_tree import INFINITE
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
from .baseline import baseline_value, is_timing
from .limits_file import Limit, Limits, Needed


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
        for name, estimator, values in matching(limits, index, measured):
            lines += _lines(limits, index, (name, measured.runs[name]), (estimator, values), baseline, updating)
    needed = limits.content.reference
    several = len(measured.runs) > 1
    return Checked(
        lines=tuple(lines),
        references=tuple(filter(None, (_reference(*run, several=several) for run in measured.runs.items()))),
        sigmas=tuple(filter(None, (_sigma(*run, several=several) for run in measured.runs.items()))),
        shortages=_shortages(lines, several=several),
        undecided=needed is not Needed.NONE and any(is_undertrusted(run, needed) for run in measured.runs.values()),
        measured=measured,
        limits=shown(limits.path),
        baseline=None if baseline is None else shown(baseline.path),
    )


def matching(limits: TomlFile[Limits], index: int, measured: Measured) -> list[tuple[str, str, Mapping[str, Any]]]:
    """Runs, estimators and values that a limit matches. Raises InputError where one of its patterns matches nothing."""
    limit = limits.content.limit[index]
    runs = {name: run for name, run in measured.runs.items() if fnmatchcase(name, limit.runs)}
    if not runs:
        said = f'runs = "{limit.runs}" matches no run in {shown(measured.path)}; there are {", ".join(measured.runs)}'
        raise limits.wrong(("limit", index, "runs"), said)
    there = sorted({name for run in runs.values() for name in run.estimators})
    for pattern in limit.patterns:
        if not any(fnmatchcase(name, pattern) for name in there):
            said = f'estimators = "{pattern}" matches no estimator; there are {", ".join(there)}'
            raise limits.wrong(("limit", index, "estimators"), said)
    chosen: list[tuple[str, str, Mapping[str, Any]]] = [
        (name, estimator, values)
        for name, run in runs.items()
        for estimator, values in run.estimators.items()
        if any(fnmatchcase(estimator, pattern) for pattern in limit.patterns)
    ]
    if not any(failure(values) or has_metric(values, limit.metric) for *_, values in chosen):
        known = sorted({metric for *_, values in chosen for metric in metrics_of(values)})
        said = f'metric = "{limit.metric}" is not a number of any matching estimator; there are '
        raise limits.wrong(("limit", index, "metric"), said + nearest(limit.metric, known))
    return chosen


def is_undertrusted(run: MeasuredRun, needed: Needed) -> bool:
    """Whether a run's reference is less trusted than needed; one without a trust is the user's own."""
    trust = run.reference.trust
    return trust == "untrusted" or (trust == "doubtful" and needed is Needed.TRUSTED)


def _lines(
    limits: TomlFile[Limits],
    index: int,
    named_run: tuple[str, MeasuredRun],
    named_values: tuple[str, Mapping[str, Any]],
    baseline: Measured | None,
    updating: bool,
) -> Iterator[Line]:
    """One line for the limit's own bounds, and one for the bounds around the baseline."""
    limit = limits.content.limit[index]
    (name, run), (estimator, values) = named_run, named_values
    value, missing = value_of(values, limit.metric)
    old, unknown = baseline_value(baseline, name, run, estimator, limit.metric)
    shortage = _shortage(limits.content, limit, values)
    doubt = shortage.reason if shortage else _doubt(limit.metric, run, limits.content.reference) or _below(limit, run)

    def line(value: float | None, bounds: Bounds | None, tolerance: str) -> Line:
        short = failure(values) is not None or missing in (INFINITE, NO_SUCH_METRIC)
        outcome, reason = _outcome(value, missing, bounds, NEW if updating else unknown, doubt, updating, short)
        left_out, place = missing_in(values, limit.metric), f"limit[{index}]"
        return Line(
            name, estimator, limit.metric, place, outcome, value, bounds, tolerance, old, reason, left_out, shortage
        )

    if limit.bounds is not None:
        yield line(value, limit.bounds, "")
    if limit.baseline is not None:
        by = limit.baseline
        bounds = None if old is None else around(old, by.better, relative=by.relative, absolute=by.absolute)
        yield line(None if value is None else rounded(value, DIGITS), bounds, by.text)


def _outcome(
    value: float | None, missing: str, bounds: Bounds | None, unknown: str, doubt: str, updating: bool, short: bool
) -> tuple[Outcome, str]:
    if value is None:
        return Outcome.VIOLATED if short else Outcome.UNDECIDED, missing
    if doubt:
        return Outcome.UNDECIDED, doubt
    if bounds is None:
        return Outcome.HOLDS if updating else Outcome.UNDECIDED, unknown
    return bounds.judge(value), ""


def _doubt(metric: str, run: MeasuredRun, needed: Needed) -> str:
    """Why a metric is undecided: guessed units, or the reference; empty where neither applies."""
    if run.guessed_units:
        return (
            f"the units of the recording ({', '.join(run.guessed_units)}) were estimated from its data; specify them "
            "with run --time-unit, or with a table [units] in --repairs"
        )
    if not run.rests_on_reference(metric) or not is_undertrusted(run, needed):
        return ""
    return f"the reference is {run.reference.trust}"


def _below(limit: Limit, run: MeasuredRun) -> str:
    """Why a limit asks for more than the reference resolves; empty where it does not, or is not to be judged so."""
    if not limit.within_reference_sigma or limit.at_most is None:
        return ""
    sigma = None if run.reference.sigma is None else run.reference.sigma.of(limit.metric)
    if sigma is None:
        return "the sigma of the reference is unknown (within_reference_sigma)"
    unit = "°" if "rotation" in limit.metric else " m"
    if limit.at_most >= sigma:
        return ""
    return f"the limit is below the sigma of the reference, {number(sigma)}{unit} (within_reference_sigma)"


def _shortage(limits: Limits, limit: Limit, values: Mapping[str, Any]) -> Shortage | None:
    """The shortage of a metric's sample; None where it is large enough, or the metric has no sample."""
    sample = sample_of(values, limit.metric)
    smallest = limit.smallest_sample or limits.smallest_sample
    coverage = limits.smallest_coverage if limit.smallest_coverage is None else limit.smallest_coverage
    if sample is None or not is_insufficient(sample, smallest, coverage):
        return None
    stretches = int(sample.get("stretches", MIN_STRETCHES))
    if sample["n"] >= smallest and stretches < MIN_STRETCHES:
        return Shortage(stretches, sample.get("coverage"), MIN_STRETCHES, coverage)
    return Shortage(int(sample["n"]), sample.get("coverage"), smallest, coverage)


def _shortages(lines: list[Line], *, several: bool) -> tuple[str, ...]:
    """A sentence for each shortage, with its metrics and estimators."""
    found: dict[tuple[Shortage, str], tuple[dict[str, None], dict[str, None]]] = {}
    for line in lines:
        if line.shortage is not None and line.value is not None:
            metrics, names = found.setdefault((line.shortage, line.run if several else ""), ({}, {}))
            metrics[line.metric], names[line.estimator] = None, None
    return tuple(
        f"Too little data{f' in {run}' if run else ''} for {', '.join(metrics)} of {', '.join(names)}: "
        f"{shortage.reason} (smallest_sample, smallest_coverage)."
        for (shortage, run), (metrics, names) in found.items()
    )


def _require_baseline(limits: TomlFile[Limits], index: int, limit: Limit, *, given: bool) -> None:
    if limit.baseline is None:
        return
    place = ("limit", index, "baseline")
    if is_timing(limit.metric):
        raise limits.wrong(place, f"a baseline has no timings such as {limit.metric}; use at_most")
    if not given:
        raise limits.wrong(place, "this limit needs a baseline; name one with --baseline FILE")


def _sigma(name: str, run: MeasuredRun, *, several: bool) -> str:
    """The sentence on the sigma of a run's reference; empty where it is unknown."""
    reference = run.reference
    if reference.sigma is None or reference.name is None:
        return ""
    where = f"{name}: " if several else ""
    return where + reference_sigma_sentence(reference.name, reference.sigma.model_dump())


def _reference(name: str, run: MeasuredRun, *, several: bool) -> str:
    """The sentence on a reference that is not trusted; empty for a trusted one."""
    reference = run.reference
    if reference.trust in (None, "trusted"):
        return ""
    where = f" of {name}" if several else ""
    why = f": {reference.reasons[0]}" if reference.reasons else ""
    return f"The reference{where}{f', {reference.name},' if reference.name else ''} is {reference.trust}{why}."
