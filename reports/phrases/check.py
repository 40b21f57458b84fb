"""Sentences and texts of a check, for every form of output."""

from collections.abc import Iterable

from fgbaseline.compare.acceptance_limits import Bounds, Outcome
from fgbaseline.data.wording import plural

from ..results.check import NEW, Checked, Line, Shortage
from ..results.reader import ReferenceRecord


def verdict(checked: Checked) -> str:
    """The outcome, in a sentence."""
    n, count = len(checked.lines), checked.count
    parts = [violated_limits(checked)] if count[Outcome.VIOLATED] else []
    if undecided := count[Outcome.UNDECIDED]:
        parts.append(f"{undecided} of {plural(n, 'limit')} {'is' if undecided == 1 else 'are'} undecided")
    if parts:
        return f"{' and '.join(parts)}."
    hold = "The limit holds" if n == 1 else f"All {n} limits hold"
    return f"{hold}, but the reference is not trusted enough: undecided." if checked.undecided else f"{hold}."


def violated_limits(checked: Checked) -> str:
    """Number of violated limits: `1 of 12 limits is violated`."""
    n = checked.count[Outcome.VIOLATED]
    return f"{n} of {plural(len(checked.lines), 'limit')} {'is' if n == 1 else 'are'} violated"


def untrusted_reference(run: str, reference: ReferenceRecord) -> str:
    """Trust in a reference, with its first reason; `run` is empty where there is but one."""
    name = f", {reference.name}," if reference.name else ""
    why = f": {reference.reasons[0]}" if reference.reasons else ""
    return f"The reference{f' of {run}' if run else ''}{name} is {reference.trust}{why}."


def too_little_data(lines: Iterable[Line]) -> tuple[str, ...]:
    """A sentence for each shortage and run, with its metrics and estimators."""
    found: dict[tuple[Shortage, str], tuple[dict[str, None], dict[str, None]]] = {}
    for line in lines:
        if line.shortage is not None and line.value is not None:
            metrics, names = found.setdefault((line.shortage, line.run), ({}, {}))
            metrics[line.metric], names[line.estimator] = None, None
    return tuple(
        f"Too little data{f' in {run}' if run else ''} for {', '.join(metrics)} of {', '.join(names)}: "
        f"{shortage.reason} (smallest_sample, smallest_coverage)."
        for (shortage, run), (metrics, names) in found.items()
    )


def remarks(checked: Checked) -> list[str]:
    """Why a line has no value or no baseline, and errors that its value leaves out: a sentence for each such line."""
    several = len(checked.measured.runs) > 1
    sentences = []
    for line in checked.lines:
        left_out = f"{plural(line.missing, 'NaN error')} left out" if line.missing else ""
        reasons = [reason for reason in (line.reason, left_out) if reason not in ("", NEW)]
        if reasons:
            name = f"{f'{line.run}, ' if several else ''}{line.estimator}, {line.metric}"
            sentences.append(f"{name}: {'; '.join(reasons)} ({checked.limits}, {line.limit}).")
    return sentences


def bound(bounds: Bounds | None, tolerance: str = "") -> str:
    """Bounds as text: `<= 0.5` or `0.3 to 0.6`."""
    if bounds is None:
        return f"baseline, {tolerance} allowed"
    low, high = f"{bounds.at_least:.5g}", f"{bounds.at_most:.5g}"
    text = f"<= {high}" if low == "-inf" else f">= {low}" if high == "inf" else f"{low} to {high}"
    return f"{text} ({tolerance} allowed)" if tolerance else text


def change(line: Line) -> str:
    """Change from the baseline, in the metric's unit and in percent."""
    if line.change is None or line.before is None:
        return "new" if line.reason == NEW else "-"
    share = f" ({100.0 * line.change / abs(line.before):+.2g} %)" if line.before and line.change else ""
    return ("none" if line.change == 0 else number(line.change, sign=True)) + share


def number(value: float | None, *, sign: bool = False) -> str:
    """Five significant digits, three of a margin or a change; a dash for None."""
    return "-" if value is None else f"{value:+.3g}" if sign else f"{value:.5g}"
