"""`summary.json` of a bench: every run's figures without timings, as `fgbaseline check` reads it."""

import json
from typing import Any, Final

from .results import Results

SCHEMA: Final = "fgbaseline/bench/1"
OF_A_RUN = ("problem", "reference", "held_out", "estimators")


def summarised(name: str, results: Results) -> str:
    """The text: the same for the same jobs, whoever did them and when."""
    runs: dict[str, Any] = {}
    for one in results.planned:
        told = {
            "sequence": {"name": one.sequence},
            "settings": {"seed": one.job.seed, **one.settings},
            "key": one.job.key,
        }
        if one.name in results.failures:
            failed = {"status": "failed", "reason": results.failures[one.name]}
            nobody: dict[str, Any] = {"name": None, "trust": None, "reasons": []}
            runs[one.name] = {**told, "reference": nobody, "estimators": dict.fromkeys(one.job.estimators, failed)}
        else:
            summary = results.summaries[one.name]
            runs[one.name] = {**told, **{part: summary[part] for part in OF_A_RUN}}
    document = {"schema": SCHEMA, "suite": name, "versions": _versions(results), "runs": runs}
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def _versions(results: Results) -> Any:
    return next((summary["versions"] for summary in results.summaries.values()), {})
