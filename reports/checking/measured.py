"""What was measured: the summary that `run`, `compare` and `bench` leave behind, or a baseline made from one."""

import difflib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fgbaseline.data.formats.named_file import reading, regular_file, shown
from fgbaseline.geometry import InputError

SUMMARY = "summary.json"
BASELINE = "fgbaseline/baseline/1"
DIGITS = 5
"""significant ones, of a baseline: what lies beyond differs between processors and libraries"""
NO_METRICS = frozenset({"status", "reason", "notes", "events"})
"""what a summary says of an estimator beside its metrics (a kind of event that did not occur is not even a zero)"""
ON_REFERENCE = frozenset({"divergence", "nees_reference", "sigma_ratio", "map"})
"""what is measured from the reference"""


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class Reference(_Part):
    """What divergence is measured from, and how far it can be leaned on."""

    name: str | None = None
    trust: Literal["trusted", "doubtful", "untrusted"]
    reasons: tuple[str, ...] = ()


class Sequence(_Part):
    """What was recorded."""

    name: str = ""


class MeasuredRun(_Part):
    """The estimators of one sequence."""

    reference: Reference | None = None
    """None where nobody can say: trajectories compared with one that the user gave"""
    sequence: Sequence = Sequence()
    estimators: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]


class _Several(_Part):
    runs: Annotated[dict[str, MeasuredRun], Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class Measured:
    """One run or several, by name."""

    path: Path
    runs: Mapping[str, MeasuredRun]
    schema: str


def read_folder(folder: Path) -> Measured:
    """What a folder's summary.json holds. Raises InputError."""
    if not folder.is_dir():
        raise InputError(
            f"{shown(folder)}: there is no such folder; give one that fgbaseline run, compare or bench wrote"
        )
    if not (folder / SUMMARY).is_file():
        raise InputError(
            f"{shown(folder)}: it holds no {SUMMARY}; give a folder that fgbaseline run, compare or bench wrote"
        )
    return read_measured(folder / SUMMARY)


def read_measured(path: Path) -> Measured:
    """What a summary.json or a baseline holds. Raises InputError naming the file and what is wrong in it."""
    with reading(path):
        text = regular_file(path).read_bytes()
        try:
            document = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"this is not JSON ({error}); give a {SUMMARY} or a baseline") from None
        if not isinstance(document, dict) or not str(document.get("schema", "")).startswith("fgbaseline/"):
            raise InputError(f'it has no "schema" of fgbaseline\'s; give a {SUMMARY} or a baseline')
        try:
            if "runs" in document:
                runs = dict(_Several.model_validate(document).runs)
            else:
                run = MeasuredRun.model_validate(document)
                runs = {run.sequence.name: run}
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = ".".join(map(str, first["loc"]))
            raise InputError(f"{where}: {first['msg'][:1].lower()}{first['msg'][1:]}; write the file anew") from None
    return Measured(path, runs, str(document["schema"]))


def failure(estimator: Mapping[str, Any]) -> str | None:
    """Why an estimator has no answer; None where it has one."""
    if estimator.get("status", "ok") != "failed":
        return None
    return f"the estimator failed: {estimator.get('reason') or 'no reason given'}"


def has_metric(estimator: Mapping[str, Any], metric: str) -> bool:
    """Whether a path leads to a number, or to where one is missing: a null at its end or on the way."""
    found = _at(estimator, metric)
    return found is None or (isinstance(found, int | float) and not isinstance(found, bool))


def value_of(estimator: Mapping[str, Any], metric: str) -> tuple[float | None, str]:
    """The finite number at a path, or None and why there is none."""
    if (reason := failure(estimator)) is not None:
        return None, reason
    found = _at(estimator, metric)
    if found is _ABSENT:
        return None, "it has no such metric"
    if isinstance(found, int | float) and not isinstance(found, bool) and math.isfinite(found):
        return float(found), ""
    notes = estimator.get("notes") or {}
    keys = [metric.rsplit(".", n)[0] for n in range(metric.count(".") + 1)]
    return None, next((str(notes[key]) for key in (*keys, "*") if key in notes), "it is not a finite number")


def rests_on_reference(metric: str) -> bool:
    """Whether a metric says nothing where the reference is wrong."""
    return metric.partition(".")[0] in ON_REFERENCE


def metrics_of(estimator: Mapping[str, Any]) -> list[str]:
    """The paths of all numbers of an estimator."""
    return [path for path, _ in _numbers(estimator, "") if path.partition(".")[0] not in NO_METRICS]


def nearest(metric: str, known: list[str]) -> str:
    """What somebody may have meant who wrote `metric`, as the end of a sentence."""
    below = [path for path in known if path.startswith(f"{metric}.")]
    near = below or difflib.get_close_matches(metric, known, n=3) or known
    return ", ".join(near[:8]) + (", ..." if len(near) > 8 else "")


_ABSENT = object()


def _at(estimator: Mapping[str, Any], metric: str) -> Any:
    """What stands at a path; None where a null stands on the way, _ABSENT where there is nothing."""
    found: Any = estimator
    if metric.partition(".")[0] in NO_METRICS:
        return _ABSENT
    for part in metric.split("."):
        if found is None:
            return None
        if not isinstance(found, dict) or part not in found:
            return _ABSENT
        found = found[part]
    return found


def _numbers(value: Any, path: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _numbers(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, float(value)
