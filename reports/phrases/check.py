"""Sentences and texts of a check that every form of output shares."""

from fgbaseline.compare.limits import Bounds, Outcome
from fgbaseline.data.plural import plural

from ..results.check import NEW, Checked, Line


def verdict(checked: Checked) -> str:
    """The outcome, in a sentence."""
    n, count = len(checked.lines), checked.count
    short, unknown = count[Outcome.FALLS_SHORT], count[Outcome.CANNOT_TELL]
    parts = [f"{short} of {n} limits {'falls' if short == 1 else 'fall'} short"] if short else []
    parts += [f"{unknown} of {n} cannot be told"] if unknown else []
    if parts:
        return f"{' and '.join(parts)}."
    hold = "the limit holds" if n == 1 else f"all {n} limits hold"
    if checked.undecided:
        return f"By the figures {hold}, but the reference is not trusted enough to say so."
    return f"{hold[0].upper()}{hold[1:]}."


def remarks(checked: Checked) -> list[str]:
    """Reasons why there is no value, or nothing to hold it against: a sentence for each such line."""
    several = len(checked.measured.runs) > 1
    sentences = []
    for line in checked.lines:
        left_out = (
            f"{plural(line.missing, 'error is', 'errors are')} missing (NaN) and left out" if line.missing else ""
        )
        reasons = [reason for reason in (line.reason, left_out) if reason not in ("", NEW)]
        if reasons:
            name = f"{f'{line.run}, ' if several else ''}{line.estimator}, {line.metric}"
            sentences.append(f"{name}: {'; '.join(reasons)} ({checked.limits}, {line.limit}).")
    return sentences


def bound(bounds: Bounds | None, tolerance: str = "") -> str:
    """Such as '<= 0.5' or '0.3 to 0.6'."""
    if bounds is None:
        return f"baseline, {tolerance} allowed"
    low, high = f"{bounds.at_least:.5g}", f"{bounds.at_most:.5g}"
    text = f"<= {high}" if low == "-inf" else f">= {low}" if high == "inf" else f"{low} to {high}"
    return f"{text} ({tolerance} allowed)" if tolerance else text


def change(line: Line) -> str:
    """Change against the baseline, and its share of that."""
    if line.change is None or line.before is None:
        return "new" if line.reason == NEW else "-"
    share = f" ({100.0 * line.change / abs(line.before):+.2g} %)" if line.before and line.change else ""
    return ("none" if line.change == 0 else number(line.change, sign=True)) + share


def number(value: float | None, *, sign: bool = False) -> str:
    """Five significant digits, of a margin or a change three; a dash for none."""
    return "-" if value is None else f"{value:+.3g}" if sign else f"{value:.5g}"
