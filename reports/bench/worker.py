"""Work of a worker process: a job in, the files of its run out as bytes. GTSAM objects do not leave it.

A worker refuses a job whose files or code have changed since it was planned; the hashes of both are part of its key.
"""

import hashlib
import json
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, entry_points, version
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock

from threadpoolctl import threadpool_limits

from fgbaseline.compare.estimate_comparison import Run, compare_all
from fgbaseline.data import LandmarkMode, Problem, Progress, Sequence, documented, read
from fgbaseline.data.estimators.registry import GROUP
from fgbaseline.data.estimators.runner import Watch, describe, solve_all
from fgbaseline.data.problem.documented import DEFAULT_FEATURES
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.diagnosis import AsRecordedSettings, calibrated, hold_out, read_repairs
from fgbaseline.diagnosis.repair_overrides.settings import Repairs
from fgbaseline.geometry import FgbaselineError

from ..results.bench import File, Job, Recorded
from ..run.folder import write_numbers, write_page, write_run

COSTS = "costs.json"
LIBRARIES = ("gtsam", "numpy", "scipy", "pandas", "threadpoolctl")
ROOMS = ("geometry", "data", "diagnosis", "ekf", "smoother", "compare")
RESET_PEAK = "5"
"""makes Linux reset the peak memory (man 5 proc, clear_refs)"""
Channel = Callable[[str, str, int, int], None]
"""takes progress: key of the job, step, frames done, frames in total"""
Report = Callable[[str, int, int], None]
"""takes progress of a job: step or estimator, frames done, frames in total"""
_one_job = Lock()
"""one job per process: memory and BLAS threads are the process's, and GTSAM holds the interpreter lock"""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a job."""

    key: str
    files: Mapping[str, bytes]
    """by path in the run's folder; empty where the job failed"""
    failure: str
    """reason of the failure; empty for a success"""
    seconds: float


def work(job: Job, channel: Channel) -> Outcome:
    """Runs a job; an error is its outcome, and never raised."""
    with _one_job, threadpool_limits(limits=1):
        start = time.perf_counter()
        try:
            files, failure = _files(job, partial(channel, job.key)), ""
        except Exception as error:  # a job never stops the others
            files, failure = {}, describe(error)
        seconds = time.perf_counter() - start
    channel("", "", 0, 0)
    return Outcome(job.key, files, failure, seconds)


def _files(job: Job, report: Report) -> dict[str, bytes]:
    if code_hash(job.estimators, job.page != "none") != job.code:
        raise FgbaselineError("this worker has a different version of fgbaseline or of its libraries; install the same")
    report("reading", 0, 0)
    sequence = _sequence(job)
    kept, held = hold_out(sequence, job.held_out, job.seed) if job.held_out else (sequence, None)
    report("building the problem", 0, 0)
    problem = _problem(kept, job)
    peak_mb: dict[str, float] = {}
    estimates = solve_all(problem, job.estimators, _cost_watch(report, peak_mb))
    run = compare_all(problem, estimates, job.record(), held)
    report("writing", 0, 0)
    with TemporaryDirectory(prefix="fgbaseline-") as place:
        folder = Path(place)
        if job.page == "figures":
            write_run(run, folder)
        else:
            summary = write_numbers(run, folder)
            if job.page == "tables":
                write_page(run, summary, folder, {})
        (folder / COSTS).write_text(json.dumps(_costs(run, peak_mb), indent=2))
        return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def _sequence(job: Job) -> Sequence:
    if not isinstance(job.source, Recorded):
        return simulate(Simulation(**job.source.settings, seed=job.seed))
    for file in (job.source.recording, job.source.truth, job.source.repairs):
        if file is not None:
            _require_unchanged(file)
    truth = job.source.truth
    return read(job.source.recording.path, None if truth is None else truth.path, job.source.truth_frame)


def _require_unchanged(file: File) -> None:
    path = Path(file.path)
    if not path.is_file():
        raise FgbaselineError(f"{path}: there is no such file on the worker's machine; copy it there")
    if file_hash(path) != file.content:
        raise FgbaselineError(f"{path}: the file has changed since the bench was planned; run the bench again")


def _problem(sequence: Sequence, job: Job) -> Problem:
    features = None if job.features == "all" else job.features
    if job.preset == "documented":
        count = DEFAULT_FEATURES if job.features is None else features
        return documented(sequence, count, LandmarkMode(job.landmarks))
    if job.noise == "assumed":
        return calibrated(sequence, features, settings=AsRecordedSettings())
    if isinstance(job.noise, Mapping):
        repairs: Repairs | None = Repairs.model_validate({"sigma": dict(job.noise)})
    elif isinstance(job.source, Recorded) and job.source.repairs is not None:
        repairs = read_repairs(job.source.repairs.path)
    else:
        repairs = None
    return calibrated(sequence, features, repairs=repairs)


def _costs(run: Run, peak_mb: Mapping[str, float]) -> dict[str, object]:
    """Costs by estimator; a by-product has the cost of its run."""
    source = {by: name for name, r in run.results.items() for by in r.estimate.by_products if by not in peak_mb}
    memory = {name: peak_mb.get(source.get(name, name)) for name in run.results}
    seconds = {name: result.estimate.seconds_total for name, result in run.results.items()}
    return {"estimators": {name: {"seconds": seconds[name], "memory_mb": memory[name]} for name in run.results}}


def _cost_watch(report: Report, peak_mb: dict[str, float]) -> Watch:
    """Reports the progress of estimators, one at a time, and puts their peak memory into `peak_mb`.

    That is the resident memory of the process, MB; an estimator has none where the system does not measure it.
    """

    @contextmanager
    def watch(name: str) -> Iterator[Progress]:
        report(name, 0, 0)
        is_reset = _reset_peak()
        yield lambda done, total, /: report(name, done, total)
        if is_reset and (peak := _peak_mb()) is not None:
            peak_mb[name] = peak

    return watch


def _reset_peak() -> bool:
    try:
        Path("/proc/self/clear_refs").write_text(RESET_PEAK)
    except OSError:
        return False
    return True


def _peak_mb() -> float | None:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024 / 1e6
    return None


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
    yield reports / "bench" / "worker.py"
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
