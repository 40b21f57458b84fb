"""The reader of summary.json (run, bench), comparison.json and baselines, and of the other files of a run's folder."""

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from fgbaseline.data import Landmarks, Trajectory
from fgbaseline.data.finding import AS_GIVEN, UNITS
from fgbaseline.data.formats import read_landmarks, read_trajectory
from fgbaseline.data.formats.file_errors import reading, regular_file
from fgbaseline.data.toml_file import is_finite_number
from fgbaseline.geometry import InputError

from .json_files import INFINITE, SUMMARY, document_in, leaves, read_document

if TYPE_CHECKING:
    import pandas as pd

TRUTH = "truth.tum"
BASELINE = "fgbaseline/baseline/1"
NO_SUCH_METRIC = "it has no such metric"
NOT_INERTIAL = "the run has no raw inertial data"
DIGITS = 5
"""significant ones, of a baseline: what lies beyond differs between processors and libraries"""
NO_METRICS = frozenset({"status", "reason", "notes", "events"})
"""keys of an estimator beside its metrics (a kind of event that did not occur is not even a zero)"""
DIVERGENCES = frozenset(f"{name}_divergence" for name in ("velocity", "gyroscope_bias", "accelerometer_bias"))
INERTIAL = DIVERGENCES | {"velocity", "velocity_unaligned", "gyroscope_bias", "accelerometer_bias", "nees_state"}
"""keys that an estimator has only in a run on raw inertial data"""
ON_REFERENCE = frozenset({"divergence", "nees_reference", "sigma_ratio", "map"}) | DIVERGENCES
"""metrics that are measured from the reference"""


class _Record(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class SigmaRecord(_Record):
    """Sigma of the reference itself, m and degrees."""

    position_rmse: float | None = None
    position_final: float | None = None
    rotation_rmse_deg: float | None = None
    rotation_final_deg: float | None = None

    def of(self, metric: str) -> float | None:
        """The sigma in the unit of a metric of `divergence`: that of the last pose for a final one."""
        quantity, when = ("rotation", "_deg") if "rotation" in metric else ("position", "")
        part = "final" if ".final" in metric or "_final" in metric else "rmse"
        found: float | None = getattr(self, f"{quantity}_{part}{when}")
        return found


class ReferenceRecord(_Record):
    """The reference that divergence is measured from, and the trust in it."""

    name: str | None = None
    trust: Literal["trusted", "doubtful", "untrusted"] | None = None
    """None if the reference is a trajectory of the user, on which no trust is decided"""
    reasons: tuple[str, ...] = ()
    sigma: SigmaRecord | None = None
    """None where it has no covariances, and in the summaries of older versions"""


class SequenceRecord(_Record):
    """The recording."""

    name: str = ""


class FindingRecord(_Record):
    """A fault of the recording."""

    code: str = ""
    certainty: str = ""


class ProblemRecord(_Record):
    """Problem that the estimators solved."""

    findings: tuple[FindingRecord, ...] = ()


class MeasuredRun(_Record):
    """The estimators of one sequence."""

    reference: ReferenceRecord = ReferenceRecord()
    problem: ProblemRecord = ProblemRecord()
    sequence: SequenceRecord = SequenceRecord()
    estimators: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]
    compared: bool = False
    """trajectories alone, all of whose errors are from the reference"""

    @model_validator(mode="before")
    @classmethod
    def _of_a_comparison(cls, document: Any) -> Any:
        """Brings `comparison.json` into the form of `summary.json`: estimates are estimators, sequence is a mapping."""
        if not isinstance(document, dict) or "estimates" not in document:
            return document
        sequence = {"name": document.get("sequence") or ""}
        return {**document, "estimators": document["estimates"], "sequence": sequence, "compared": True}

    @property
    def guessed_units(self) -> list[str]:
        """Codes of the units of the recording that were repaired from the data alone."""
        return [each.code for each in self.problem.findings if each.code in UNITS and each.certainty != AS_GIVEN]

    def rests_on_reference(self, metric: str) -> bool:
        """Whether a metric says nothing where the reference is wrong."""
        first = metric.partition(".")[0]
        return first in ON_REFERENCE or (self.compared and not first.startswith("reprojection"))


class _SuiteSummary(_Record):
    runs: Annotated[dict[str, MeasuredRun], Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class Measured:
    """The content of a summary: one run or several, by name."""

    path: Path
    runs: Mapping[str, MeasuredRun]
    schema: str


@dataclass(frozen=True, slots=True)
class RunFolder:
    """The files of a run or comparison; each method raises InputError where its file is missing or damaged."""

    folder: Path
    mark: str = SUMMARY
    """name of the file with its figures"""

    @property
    def summary(self) -> dict[str, Any]:
        """Content of `summary.json` or `comparison.json` as a dict."""
        return read_document(self.folder / self.mark)

    def trajectory(self, name: str) -> Trajectory:
        """The path of an estimator."""
        return read_trajectory(self.folder / "trajectories" / f"{name}.tum", "tum", name=name)

    @property
    def truth(self) -> Trajectory | None:
        """The ground truth; None where the recording has none."""
        path = self.folder / TRUTH
        return read_trajectory(path, "tum", name="truth") if path.is_file() else None

    def landmarks(self, name: str) -> Landmarks:
        """The landmarks of an estimator."""
        return read_landmarks(self.folder / "landmarks" / f"{name}.csv")

    def series(self, name: str) -> "pd.DataFrame":
        """One row per frame of an estimator, with its time `t`."""
        path = self.folder / "series" / f"{name}.csv"
        table = _csv(path)
        if table is None or "t" not in table:
            raise InputError(f"{path}: the file is missing, or has no column t; run it again")
        return table

    def table(self, name: str, within: str = "tables") -> "pd.DataFrame | None":
        """A long table; None where there is none of that name."""
        return _csv(self.folder / within / f"{name}.csv")


def _csv(path: Path) -> "pd.DataFrame | None":
    import pandas as pd  # half a second, which a check does without

    if not path.is_file():
        return None
    with reading(path):
        try:
            return pd.read_csv(regular_file(path))
        except ValueError as error:
            raise InputError(f"it is not the table that a run writes ({error}); run it again") from error


def read_folder(folder: Path) -> Measured:
    """The content of a folder's summary.json or comparison.json. Raises InputError."""
    return read_measured(document_in(folder))


def read_measured(path: Path, document: dict[str, Any] | None = None) -> Measured:
    """The runs of a summary.json, comparison.json or baseline, from its `document` if that is read already.

    Raises InputError naming file and place.
    """
    document = read_document(path) if document is None else document
    with reading(path):
        try:
            if "runs" in document:
                runs = dict(_SuiteSummary.model_validate(document).runs)
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


def missing_in(estimator: Mapping[str, Any], metric: str) -> int:
    """Number of errors that the value at a path leaves out because they are missing (NaN)."""
    found = _at(estimator, f"{metric.rpartition('.')[0]}.missing") if "." in metric else 0
    return found if isinstance(found, int) else 0


def has_metric(estimator: Mapping[str, Any], metric: str) -> bool:
    """Whether a path leads to a number, or to where one is missing: a null at its end or on the way.

    What only runs on raw inertial data have is missing in the others.
    """
    found = _at(estimator, metric)
    return found is None or is_inertial_in_other_run(estimator, metric) or _is_number(found)


def value_of(estimator: Mapping[str, Any], metric: str) -> tuple[float | None, str]:
    """The finite number at a path, or None and why there is none."""
    if (reason := failure(estimator)) is not None:
        return None, reason
    found = _at(estimator, metric)
    if is_inertial_in_other_run(estimator, metric):
        return None, NOT_INERTIAL
    if found is _ABSENT:
        return None, NO_SUCH_METRIC
    if is_finite_number(found):
        return float(found), ""
    if isinstance(found, float) and math.isinf(found):
        return None, INFINITE
    notes = estimator.get("notes") or {}
    keys = (*_beginnings(metric), "*")
    return None, next((str(notes[key]) for key in keys if key in notes), "it is not a finite number")


def is_inertial_in_other_run(estimator: Mapping[str, Any], metric: str) -> bool:
    """Whether a metric needs raw inertial data, which the run did not have."""
    first = metric.partition(".")[0]
    return first in INERTIAL and first not in estimator


def sample_of(estimator: Mapping[str, Any], metric: str) -> Mapping[str, float] | None:
    """The sample of a metric: the `n` and the `coverage` under `samples` with the longest beginning of its path.

    None for what is no statistic, such as a count or a time, and for the summaries of versions without samples.
    """
    samples: Mapping[str, Mapping[str, float]] = estimator.get("samples") or {}
    keys = [key for key in samples if metric == key or metric.startswith(f"{key}.")]
    return samples[max(keys, key=len)] if keys else None


def metrics_of(estimator: Mapping[str, Any]) -> list[str]:
    """The paths of all numbers of an estimator."""
    return [path for path, value in _values(estimator).items() if _is_number(value)]


def nearest(metric: str, known: list[str]) -> str:
    """Known metrics that resemble `metric`, as the end of a sentence."""
    below = [path for path in known if path.startswith(f"{metric}.")]
    near = below or difflib.get_close_matches(metric, known, n=3) or known
    return ", ".join(near[:8]) + (", ..." if len(near) > 8 else "")


_ABSENT = object()


def _at(estimator: Mapping[str, Any], metric: str) -> Any:
    """The value at a path; None where a null stands on the way, _ABSENT where there is nothing."""
    values = _values(estimator)
    null_above = any(values.get(path, _ABSENT) is None for path in _beginnings(metric))
    return None if null_above else values.get(metric, _ABSENT)


def _values(estimator: Mapping[str, Any]) -> dict[str, Any]:
    """All values by path; keys may have dots in them, such as the '0.5 s' of a relative error."""
    return {path: value for path, value in leaves(estimator) if path.partition(".")[0] not in NO_METRICS}


def _beginnings(metric: str) -> list[str]:
    """Key path and its prefixes, the longest first."""
    return [metric.rsplit(".", n)[0] for n in range(metric.count(".") + 1)]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
