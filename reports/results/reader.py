"""Reader of summary.json (run, bench), comparison.json and accuracy baselines, and of the other files of a run."""

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
from fgbaseline.data.formats.files.file_errors import reading, regular_file
from fgbaseline.data.formats.files.toml_file import is_finite_number
from fgbaseline.geometry import InputError

from .json_files import INFINITE, SUMMARY, document_in, leaves, read_document

if TYPE_CHECKING:
    import pandas as pd

TRUTH = "truth.tum"
BASELINE = "fgbaseline/baseline/1"
NO_SUCH_METRIC = "the estimator has no such metric"
NOT_INERTIAL = "the run has no raw inertial data"
DIGITS = 5
"""significant digits of the values in an accuracy baseline; further digits differ between processors and libraries"""
NO_METRICS = frozenset({"status", "reason", "notes", "events"})
"""keys of an estimator that are not metrics; counts of events are not, as an event that did not occur has no key"""
DIVERGENCES = frozenset(f"{name}_divergence" for name in ("velocity", "gyroscope_bias", "accelerometer_bias"))
INERTIAL = DIVERGENCES | {"velocity", "velocity_unaligned", "gyroscope_bias", "accelerometer_bias", "nees_state"}
"""first keys of metrics that exist only in a run on raw inertial data"""
ON_REFERENCE = frozenset({"divergence", "nees_reference", "sigma_ratio", "map"}) | DIVERGENCES
"""first keys of metrics that are measured from the reference"""


class _Record(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class SigmaRecord(_Record):
    """1-sigma of the poses of the reference by its own covariances, m and degrees."""

    position_rmse: float | None = None
    position_final: float | None = None
    rotation_rmse_deg: float | None = None
    rotation_final_deg: float | None = None

    def of(self, metric: str) -> float | None:
        """Sigma that a metric of `divergence` is compared with: position or rotation, RMSE or of the last pose."""
        quantity, when = ("rotation", "_deg") if "rotation" in metric else ("position", "")
        part = "final" if ".final" in metric or "_final" in metric else "rmse"
        found: float | None = getattr(self, f"{quantity}_{part}{when}")
        return found


class ReferenceRecord(_Record):
    """Reference that divergence is measured from, and the trust in it."""

    name: str | None = None
    trust: Literal["trusted", "doubtful", "untrusted"] | None = None
    """None if the reference is a trajectory of the user, whose trust is not assessed"""
    reasons: tuple[str, ...] = ()
    sigma: SigmaRecord | None = None
    """None where the reference has no covariances, and in summaries of older versions"""


class SequenceRecord(_Record):
    """Recording."""

    name: str = ""


class FindingRecord(_Record):
    """Finding of the diagnosis: a fault of the recording."""

    code: str = ""
    certainty: str = ""
    """how the repair was determined, such as `data.finding.AS_GIVEN`"""


class ProblemRecord(_Record):
    """Problem that the estimators solved."""

    findings: tuple[FindingRecord, ...] = ()


class MeasuredRun(_Record):
    """Results of the estimators on one recording, or of the estimates of a comparison."""

    reference: ReferenceRecord = ReferenceRecord()
    problem: ProblemRecord = ProblemRecord()
    sequence: SequenceRecord = SequenceRecord()
    estimators: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]
    compared: bool = False
    """True for a comparison of trajectories: its errors are from the reference, except reprojection errors"""

    @model_validator(mode="before")
    @classmethod
    def _of_a_comparison(cls, document: Any) -> Any:
        """Converts the content of comparison.json to that of summary.json: key `estimators`, sequence as a mapping."""
        if not isinstance(document, dict) or "estimates" not in document:
            return document
        sequence = {"name": document.get("sequence") or ""}
        return {**document, "estimators": document["estimates"], "sequence": sequence, "compared": True}

    @property
    def guessed_units(self) -> list[str]:
        """Codes of findings on units that were guessed from the data and not given by the user."""
        return [each.code for each in self.problem.findings if each.code in UNITS and each.certainty != AS_GIVEN]

    def rests_on_reference(self, metric: str) -> bool:
        """Whether a metric is measured from the reference, and means nothing if the reference is wrong."""
        first = metric.partition(".")[0]
        return first in ON_REFERENCE or (self.compared and not first.startswith("reprojection"))


class _SuiteSummary(_Record):
    runs: Annotated[dict[str, MeasuredRun], Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class Measured:
    """Content of a summary: one run, or several of a bench, by name."""

    path: Path
    runs: Mapping[str, MeasuredRun]
    schema: str


@dataclass(frozen=True, slots=True)
class RunFolder:
    """Files of a run or comparison. Methods raise InputError where a required file is missing or damaged."""

    folder: Path
    mark: str = SUMMARY
    """name of the summary file: summary.json or comparison.json"""

    @property
    def summary(self) -> dict[str, Any]:
        """Content of `summary.json` or `comparison.json` as a dict."""
        return read_document(self.folder / self.mark)

    def trajectory(self, name: str) -> Trajectory:
        """Trajectory of an estimator."""
        return read_trajectory(self.folder / "trajectories" / f"{name}.tum", "tum", name=name)

    @property
    def truth(self) -> Trajectory | None:
        """Ground truth; None where the recording has none."""
        path = self.folder / TRUTH
        return read_trajectory(path, "tum", name="truth") if path.is_file() else None

    def landmarks(self, name: str) -> Landmarks:
        """Landmarks of an estimator."""
        return read_landmarks(self.folder / "landmarks" / f"{name}.csv")

    def series(self, name: str) -> "pd.DataFrame":
        """Series of an estimator, one row per frame with its time `t`, s."""
        path = self.folder / "series" / f"{name}.csv"
        table = _csv(path)
        if table is None or "t" not in table:
            raise InputError(f"{path}: the file is missing, or has no column t; repeat the run")
        return table

    def table(self, name: str, within: str = "tables") -> "pd.DataFrame | None":
        """Table `within/name.csv` of the folder; None where the file does not exist."""
        return _csv(self.folder / within / f"{name}.csv")


def _csv(path: Path) -> "pd.DataFrame | None":
    import pandas as pd  # imported here, as `check` does not need it and saves half a second

    if not path.is_file():
        return None
    with reading(path):
        try:
            return pd.read_csv(regular_file(path))
        except ValueError as error:
            raise InputError(f"it is not a table as a run writes it ({error}); repeat the run") from error


def read_folder(folder: Path) -> Measured:
    """Content of summary.json or comparison.json in a folder. Raises InputError for a missing or damaged file."""
    return read_measured(document_in(folder))


def read_measured(path: Path, document: dict[str, Any] | None = None) -> Measured:
    """Runs of a summary.json, comparison.json or accuracy baseline; `document` is its content if already read.

    Raises InputError, with file and key path, for content that is not one of these.
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
            raise InputError(
                f"{where}: {first['msg'][:1].lower()}{first['msg'][1:]}; write the file again with fgbaseline"
            ) from None
    return Measured(path, runs, str(document["schema"]))


def failure(estimator: Mapping[str, Any]) -> str | None:
    """Why an estimator has no result; None where it has one."""
    if estimator.get("status", "ok") != "failed":
        return None
    return f"the estimator failed: {estimator.get('reason') or 'no reason given'}"


def missing_in(estimator: Mapping[str, Any], metric: str) -> int:
    """Number of missing errors (NaN) that the metric at a key path leaves out, from the `missing` beside it."""
    found = _at(estimator, f"{metric.rpartition('.')[0]}.missing") if "." in metric else 0
    return found if isinstance(found, int) else 0


def has_metric(estimator: Mapping[str, Any], metric: str) -> bool:
    """Whether a key path is that of a metric, with or without a value.

    A metric without a value is null, or has a key on its path that is null, or needs raw inertial data that the run did
    not have.
    """
    found = _at(estimator, metric)
    return found is None or is_inertial_in_other_run(estimator, metric) or _is_number(found)


def value_of(estimator: Mapping[str, Any], metric: str) -> tuple[float | None, str]:
    """Finite number at a key path and an empty text, or None and the reason."""
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
    """Sample size `n` and `coverage` of a metric: the entry of `samples` whose key is the longest prefix of its path.

    None for metrics that are not statistics, such as counts and times, and in summaries of versions without samples.
    """
    samples: Mapping[str, Mapping[str, float]] = estimator.get("samples") or {}
    keys = [key for key in samples if metric == key or metric.startswith(f"{key}.")]
    return samples[max(keys, key=len)] if keys else None


def metrics_of(estimator: Mapping[str, Any]) -> list[str]:
    """Key paths of all numbers of an estimator."""
    return [path for path, value in _values(estimator).items() if _is_number(value)]


def nearest(metric: str, known: list[str]) -> str:
    """Known metrics that resemble `metric`, as a list for the end of a sentence."""
    below = [path for path in known if path.startswith(f"{metric}.")]
    near = below or difflib.get_close_matches(metric, known, n=3) or known
    return ", ".join(near[:8]) + (", ..." if len(near) > 8 else "")


_ABSENT = object()


def _at(estimator: Mapping[str, Any], metric: str) -> Any:
    """Value at a key path; None if a key on the path is null, _ABSENT if the path does not exist."""
    values = _values(estimator)
    null_above = any(values.get(path, _ABSENT) is None for path in _beginnings(metric))
    return None if null_above else values.get(metric, _ABSENT)


def _values(estimator: Mapping[str, Any]) -> dict[str, Any]:
    """Values of all metrics by key path. A key may contain a dot, such as '0.5 s' of a relative error."""
    return {path: value for path, value in leaves(estimator) if path.partition(".")[0] not in NO_METRICS}


def _beginnings(metric: str) -> list[str]:
    """A key path and its prefixes, the longest first."""
    return [metric.rsplit(".", n)[0] for n in range(metric.count(".") + 1)]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
