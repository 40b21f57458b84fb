"""One job of a bench: plain data that any process on any machine can be given, and the key it is known by."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal


@dataclass(frozen=True, slots=True)
class File:
    """A file that a job reads."""

    path: str
    """absolute: processes elsewhere need to see it under the same path"""
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
    """of `Simulation`, without the seed"""


@dataclass(frozen=True, slots=True)
class Job:
    """Everything that decides what comes out."""

    source: Recorded | Simulated
    seed: int
    preset: Literal["calibrated", "documented"]
    features: int | Literal["all"] | None
    noise: str | Mapping[str, float]
    """estimated, assumed, or standard deviations by name"""
    landmarks: Literal["in-turn", "held"]
    held_out: float
    estimators: tuple[str, ...]
    page: Literal["none", "tables", "figures"]
    code: str
    """of what the job runs: see `cache_key.code_of`"""

    @property
    def key(self) -> str:
        """What the job is known by: the same content, settings and code have the same key, wherever files lie."""
        content = asdict(self)
        for file in content["source"].values():
            if isinstance(file, dict):
                file.pop("path", None)
        content["kind"] = type(self.source).__name__
        return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()[:20]

    def record(self) -> dict[str, str | int | float | bool | None]:
        """The settings as `summary.json` of the run has them."""
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
    """A job, and what its rows are called."""

    job: Job
    case: str
    """sequence and settings: jobs that differ in the seed alone are of one case"""
    sequence: str
    settings: Mapping[str, str]
    """those that differ between the jobs of the suite, in words"""
    work: float
    """how much there is to do, in observations, to predict the time left"""
    has_seed: bool

    @property
    def name(self) -> str:
        """Of the run, unlike any other of the suite."""
        return f"{self.case} seed={self.job.seed}" if self.has_seed else self.case
