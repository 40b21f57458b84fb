"""Small summaries, limits and baselines, for tests of `check`."""

import json
from pathlib import Path
from typing import Any

from fgbaseline.reports.accuracy_check.command import Outputs, check
from fgbaseline.reports.accuracy_check.limits import read_limits
from fgbaseline.reports.results.reader import read_folder

NULLS = {"rmse": None, "max": None}


def estimator(ate: float | None = 0.4, divergence: float | None = 0.2, status: str = "ok", **more: Any) -> Any:
    """What a summary says of an estimator, as far as these tests look at it."""
    return {
        "status": status,
        "reason": "it lost its way" if status == "failed" else "",
        "seconds": 3.25,
        "ate": {"rmse": ate, "max": None if ate is None else 2.0 * ate},
        "divergence": {"rmse": divergence, "final": 0.0},
        "map": {"median": 0.3, "n": 100},
        "reprojection": {"median": 0.9, "under_3px": 0.95, "n": 2000},
        "events": {"landmark dropped": 3},
        "notes": {},
        **more,
    }


def summary(trust: str = "trusted", **estimators: Any) -> dict[str, Any]:
    """A run's summary of the estimators given (underscores become hyphens)."""
    return {
        "schema": "fgbaseline/summary/1",
        "sequence": {"name": "town"},
        "reference": {"name": "isam2", "trust": trust, "reasons": ["its pixel residuals are 9 times too large"]},
        "estimators": {name.replace("_", "-"): values for name, values in estimators.items()},
        "machine": {"cores": 2},
    }


def write(folder: Path, document: dict[str, Any], limits: str, baseline: dict[str, Any] | None = None) -> None:
    """`out/summary.json`, `limits.toml` and perhaps `baseline.json` in a folder."""
    (folder / "out").mkdir(exist_ok=True)
    (folder / "out" / "summary.json").write_text(json.dumps(document))
    (folder / "limits.toml").write_text(limits)
    if baseline is not None:
        (folder / "baseline.json").write_text(json.dumps(baseline))


def check_files(
    folder: Path, limits: Path, baseline: Path | None, outputs: Outputs | None = None, **options: bool
) -> int:
    """The exit code of a check of a folder by a limits file."""
    return check(read_folder(folder), read_limits(limits), baseline, outputs or Outputs(), **options)
