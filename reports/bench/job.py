"""Jobs of a bench: plain data for any process on any machine, and the cache key of their files, settings and code."""

import hashlib
import json
import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, entry_points, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from fgbaseline.data.registry import GROUP

LIBRARIES = ("gtsam", "numpy", "scipy", "pandas", "threadpoolctl")
ROOMS = ("geometry", "data", "diagnosis", "ekf", "smoother", "compare")


@dataclass(frozen=True, slots=True)
class File:
    """An input file of a job."""

    path: str
    """absolute; workers on other machines need it under the same path"""
    content: str
    """SHA-256"""


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording."""

    recording: File
    truth: File | None = None
    truth_frame: Literal["camera", "imu"] | None = None
    repairs: File | None = None


@dataclass(frozen=True, slots=True)
class Simulated:
    """A simulated drive."""

    settings: Mapping[str, Any]
    """settings of `Simulation`, without the seed"""


@dataclass(frozen=True, slots=True)
class Job:
    """Job of a bench: all inputs that determine the results of one run."""

    source: Recorded | Simulated
    seed: int
    preset: Literal["calibrated", "documented"]
    features: int | Literal["all"] | None
    noise: str | Mapping[str, float]
    """`estimated`, `assumed`, or standard deviations by name"""
    landmarks: Literal["in-turn", "held"]
    held_out: float
    estimators: tuple[str, ...]
    page: Literal["none", "tables", "figures"]
    code: str
    """see `code_hash`"""

    @property
    def key(self) -> str:
        """Cache key: the same for the same content, settings and code, whatever the paths of files."""
        content = asdict(self)
        for file in content["source"].values():
            if isinstance(file, dict):
                file.pop("path", None)
        content["kind"] = type(self.source).__name__
        return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()[:20]

    def record(self) -> dict[str, str | int | float | bool | None]:
        """The settings for `summary.json` of the run."""
        source = self.source.recording.path if isinstance(self.source, Recorded) else "simulated"
        drive = {} if isinstance(self.source, Recorded) else {k: str(v) for k, v in self.source.settings.items()}
        return {
            "sequence": source,
            **drive,
            "preset": self.preset,
            "estimators": ",".join(self.estimators),
            "features": self.features or "the preset's default",
            "noise": self.noise if isinstance(self.noise, str) else json.dumps(dict(self.noise)),
            "landmarks": self.landmarks,
            "seed": self.seed,
            "held_out": self.held_out,
        }


@dataclass(frozen=True, slots=True)
class Planned:
    """A job with its names in tables."""

    job: Job
    case: str
    """sequence and settings: the jobs of a case differ only in the seed"""
    sequence: str
    settings: Mapping[str, str]
    """settings that vary over the suite, as text"""
    work: float
    """number of observations, to predict the remaining time"""
    has_seed: bool

    @property
    def name(self) -> str:
        """Name of the run, unique in the suite."""
        return f"{self.case} seed={self.job.seed}" if self.has_seed else self.case


def file_hash(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache
def code_hash(estimators: tuple[str, ...], pages: bool) -> str:
    """SHA-256 of our source that a job runs, of other packages' estimators, and of the libraries' versions.

    Any change to that source makes every job run again; a change to the report of a bench does not.
    """
    digest = hashlib.sha256(platform.python_version().encode())
    for library in LIBRARIES:
        digest.update(f"{library} {version(library)}\n".encode())
    for file in sorted({*_our_files(pages), *_estimator_files(estimators)}):
        digest.update(f"{file.parent.name}/{file.name}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def _our_files(pages: bool) -> Iterator[Path]:
    for room in ROOMS:
        yield from _folder(f"fgbaseline.{room}").rglob("*.py")
    reports = _folder("fgbaseline.reports")
    yield from reports.glob("*.py")
    yield from (reports / "bench" / name for name in ("worker.py", "job.py"))
    for part in ("results", "run", "tables", *(("figures", "html", "phrases") if pages else ())):
        yield from (file for file in (reports / part).rglob("*") if file.suffix in (".py", ".html", ".css", ".js"))


def _estimator_files(estimators: Iterable[str]) -> Iterator[Path]:
    """Python files of the packages of third-party estimators."""
    points = {point.name: point for point in entry_points(group=GROUP)}
    for top in sorted({points[name].module.partition(".")[0] for name in estimators} - {"fgbaseline"}):
        spec = find_spec(top)
        if spec is None:
            continue
        for folder in spec.submodule_search_locations or ():
            yield from Path(folder).rglob("*.py")
        if spec.submodule_search_locations is None and spec.origin is not None and Path(spec.origin).is_file():
            yield Path(spec.origin)


def _folder(package: str) -> Path:
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise PackageNotFoundError(package)
    return Path(spec.origin).parent
