"""A check as JSON, for whatever reads it next."""

import json
import math
from typing import Any

from .line import Checked, Line
from .wording import unit_of, verdict

SCHEMA = "fgbaseline/check/1"


def as_json(checked: Checked) -> str:
    """The document: the outcome, where everything came from, and every line with its numbers in full."""
    document = {
        "schema": SCHEMA,
        "exit_code": checked.exit_code,
        "verdict": verdict(checked),
        "count": {outcome.value: n for outcome, n in checked.count.items()},
        "summary": str(checked.measured.path),
        "limits": checked.limits,
        "baseline": checked.baseline,
        "shortages": list(checked.shortages),
        "references": list(checked.references),
        "lines": [_line(line) for line in checked.lines],
    }
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def _line(line: Line) -> dict[str, Any]:
    return {
        "outcome": line.outcome.value,
        "run": line.run,
        "estimator": line.estimator,
        "metric": line.metric,
        "unit": unit_of(line.metric),
        "value": line.value,
        "at_least": None if line.bounds is None else _finite(line.bounds.at_least),
        "at_most": None if line.bounds is None else _finite(line.bounds.at_most),
        "tolerance": line.tolerance,
        "margin": line.margin,
        "baseline": line.before,
        "change": line.change,
        "reason": line.reason,
        "missing": line.missing,
        "sample": None if line.shortage is None else line.shortage.n,
        "coverage": None if line.shortage is None else line.shortage.coverage,
        "limit": line.limit,
    }


def _finite(bound: float) -> float | None:
    return bound if math.isfinite(bound) else None
