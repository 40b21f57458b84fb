"""A check in words and in cells that every form of output shares."""

from fgbaseline.compare.limits import Bounds, Outcome
from fgbaseline.data.plural import plural

from .line import NEW, Checked, Line

COLUMNS = ("limit", "estimator", "metric", "value", "bound", "margin", "baseline", "change")
WORDS = ("limit", "run", "estimator", "metric")
"""the columns that hold words; the others hold numbers"""
_METRES = ("ate", "ate_unaligned", "divergence")
_PIXELS = ("reprojection", "reprojection_used", "reprojection_common", "components", "held_out")
_NO_UNIT = ("behind_camera", "n", "under_3px", "rank", "block", "sse")


def verdict(checked: Checked) -> str:
    """How it went, in a sentence."""
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


def columns(checked: Checked) -> tuple[str, ...]:
    """The titles of a table; a folder of several runs has a column that names them."""
    several = len(checked.measured.runs) > 1
    return (COLUMNS[0], "run", *COLUMNS[1:]) if several else COLUMNS


def cells(line: Line) -> dict[str, str]:
    """The texts of a line, by column."""
    return {
        "limit": line.outcome.value,
        "run": line.run,
        "estimator": line.estimator,
        "metric": f"{line.metric}{f' ({unit})' if (unit := unit_of(line.metric)) else ''}",
        "value": number(line.value),
        "bound": bound(line.bounds, line.tolerance),
        "margin": number(line.margin, sign=True),
        "baseline": number(line.before),
        "change": change(line),
    }


def remarks(checked: Checked) -> list[str]:
    """What no cell says: why there is no value, or nothing to hold it against."""
    several = len(checked.measured.runs) > 1
    said = []
    for line in checked.lines:
        left_out = (
            f"{plural(line.missing, 'error is', 'errors are')} missing (NaN) and left out" if line.missing else ""
        )
        reasons = [reason for reason in (line.reason, left_out) if reason not in ("", NEW)]
        if reasons:
            name = f"{f'{line.run}, ' if several else ''}{line.estimator}, {line.metric}"
            said.append(f"{name}: {'; '.join(reasons)} ({checked.limits}, line {line.limit_line}).")
    return said


def bound(bounds: Bounds | None, tolerance: str = "") -> str:
    """Such as '<= 0.5' or '0.3 to 0.6'."""
    if bounds is None:
        return f"baseline, {tolerance} allowed"
    low, high = f"{bounds.at_least:.5g}", f"{bounds.at_most:.5g}"
    text = f"<= {high}" if low == "-inf" else f">= {low}" if high == "inf" else f"{low} to {high}"
    return f"{text} ({tolerance} allowed)" if tolerance else text


def change(line: Line) -> str:
    """By how much, and by which share of the baseline."""
    if line.change is None or line.before is None:
        return "new" if line.reason == NEW else "-"
    share = f" ({100.0 * line.change / abs(line.before):+.2g} %)" if line.before and line.change else ""
    return ("none" if line.change == 0 else number(line.change, sign=True)) + share


def number(value: float | None, *, sign: bool = False) -> str:
    """Five significant digits, of a margin or a change three; a dash for none."""
    return "-" if value is None else f"{value:+.3g}" if sign else f"{value:.5g}"


def unit_of(metric: str) -> str:
    """The unit of a metric of summary.json or comparison.json; empty for counts, shares and what is not known."""
    parts = metric.split(".")
    if parts[-1] in _NO_UNIT:
        return ""
    if any(part.endswith("_deg") for part in parts):
        return "deg"
    if parts[0] in _PIXELS:
        return "px"
    if parts[0] in _METRES or "translation" in parts or metric in ("map.median", "map.median_seen", "final_m"):
        return "m"
    return {"seconds": "s", "frames_per_second": "frames/s"}.get(metric, "")
