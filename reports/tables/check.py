"""The table of a check: a row for each limit and estimator."""

from collections.abc import Mapping

from fgbaseline.compare.acceptance_limits import Outcome

from ..phrases.check import bound, change, number
from ..results.check import Checked, Line
from ..results.metric_registry import METRICS
from .table import Row, Table, numbers, words

NUMBERS = ("value", "bound", "margin", "baseline", "change")
UNITS = {metric.key: metric.unit for metric in METRICS if metric.scale == 1.0}
_METERS = ("ate", "ate_unaligned", "divergence")
_PIXELS = ("reprojection", "reprojection_used", "reprojection_common", "components", "held_out")
_NO_UNIT = ("behind_camera", "n", "under_3px", "rank", "block", "sse")


def check_table(checked: Checked, signs: Mapping[Outcome, str] | None = None) -> Table:
    """The lines of a check, `signs` before their outcomes; several runs have a column of their names."""
    names = ("run", "estimator", "metric") if len(checked.measured.runs) > 1 else ("estimator", "metric")
    rows = []
    for line in checked.lines:
        outcome, texts = f"{signs[line.outcome]} {line.outcome}" if signs else line.outcome.value, cells(line)
        rows.append(Row.of(outcome, *(texts[title] for title in (*names, *NUMBERS)), status=line.outcome.value))
    return Table((*words(*names), *numbers(*NUMBERS)), tuple(rows), name="limit")


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


def unit_of(metric: str) -> str:
    """The unit of a metric of summary.json or comparison.json; empty for counts, shares and what is not known."""
    if metric in UNITS:
        return UNITS[metric]
    parts = metric.split(".")
    if parts[-1] in _NO_UNIT:
        return ""
    if any(part.endswith("_deg") for part in parts):
        return "°"
    if parts[0] in _PIXELS:
        return "px"
    if parts[0] in _METERS or "translation" in parts or metric == "final_m":
        return "m"
    return ""
