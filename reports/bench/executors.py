"""Executors of jobs, processes of this machine or workers of a Dask cluster, their progress, and the jobs' outcomes."""

import contextlib
import json
import os
import shutil
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any, Protocol, TypeAlias
from uuid import uuid4

from fgbaseline.geometry import InputError

from ..results.bench import Job
from .worker import Outcome, work

ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}
SECONDS_TO_CONNECT = 5
PARENT_POLL = 0.5
"""s between two checks of a worker process that its parent is alive"""
PROGRESS = "progress"
TOPIC = "fgbaseline-bench"
INTERVAL = 0.3
"""s between two progress events of the same step"""
POLL = 0.1
"""s between two checks of the jobs"""


@dataclass(frozen=True, slots=True)
class ProgressEvent:
    """Current step of a worker."""

    worker: str
    key: str
    """key of its job; empty without a job"""
    doing: str
    """an estimator's name, or `reading` and `writing`"""
    done: int
    total: int
    """frames; 0 where they are not counted"""


@dataclass(frozen=True, slots=True)
class FileChannel:
    """Channel with one file per process in a folder."""

    folder: Path

    def __call__(self, key: str, doing: str, done: int, total: int) -> None:
        """Reports progress, at most every `INTERVAL`."""
        if _is_due(key, doing):
            place = self.folder / str(os.getpid())
            partial = place.with_suffix(".partial")
            with contextlib.suppress(OSError):  # the folder is gone when the bench has ended
                partial.write_text(json.dumps([key, doing, done, total]))
                partial.replace(place)

    def events(self) -> Iterator[ProgressEvent]:
        """Yields the last event of each worker."""
        for place in sorted(self.folder.iterdir()):
            if place.suffix == "":
                with contextlib.suppress(OSError, ValueError):
                    yield ProgressEvent(place.name, *json.loads(place.read_text()))


def send_to_scheduler(key: str, doing: str, done: int, total: int) -> None:
    """Channel of Dask events, which the scheduler forwards, at most every `INTERVAL`."""
    if _is_due(key, doing):
        from distributed import get_worker

        worker = get_worker()
        worker.log_event(TOPIC, [worker.name, key, doing, done, total])


_last = ("", "", 0.0)


def _is_due(key: str, doing: str) -> bool:
    """Whether the step is new or its last event is older than `INTERVAL`; then the event counts as sent."""
    global _last
    now = time.monotonic()
    if _last[:2] == (key, doing) and now - _last[2] < INTERVAL:
        return False
    _last = (key, doing, now)
    return True


ShowProgress: TypeAlias = Callable[[Iterable[ProgressEvent]], None]
"""takes the last event of each worker, regularly"""


class Future(Protocol):
    """The outcome of a submitted job."""

    def done(self) -> bool:
        """Whether the job has ended."""
        ...

    def result(self) -> Outcome:
        """The outcome; raises where the worker died."""
        ...


@dataclass(frozen=True, slots=True)
class Workers:
    """Running workers."""

    submit: Callable[[Job], Future]
    events: Callable[[], Iterable[ProgressEvent]]
    """the last event of each worker"""


Executor: TypeAlias = Callable[..., AbstractContextManager[Workers]]
"""starts workers, as many as its optional argument says, and ends them with the block"""


def processes(count: int, folder: Path) -> Executor:
    """Processes of this machine, each with one BLAS thread; their progress goes through files in `folder`."""
    progress = folder / PROGRESS

    @contextmanager
    def executor(count: int = count) -> Iterator[Workers]:
        from joblib.externals.loky import ProcessPoolExecutor

        shutil.rmtree(progress, ignore_errors=True)
        progress.mkdir()
        channel = FileChannel(progress)
        pool = ProcessPoolExecutor(count, env=ONE_THREAD, initializer=_end_with_parent, initargs=(os.getpid(),))
        try:
            yield Workers(lambda job: pool.submit(work, job, channel), channel.events)
        finally:
            pool.shutdown(wait=True, kill_workers=True)
            shutil.rmtree(progress, ignore_errors=True)

    return executor


def _end_with_parent(parent: int) -> None:
    """In a worker process: leaves interrupts to the parent, and exits when the parent was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_POLL)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def cluster(address: str) -> Executor:
    """Workers of a running Dask scheduler; the block raises InputError where it does not answer or has none."""

    @contextmanager
    def executor(count: int | None = None) -> Iterator[Workers]:  # noqa: ARG001 - the scheduler has all its workers
        try:
            from distributed import Client
        except ImportError:
            raise InputError(
                "--scheduler needs Dask, which is not installed; pip install 'fgbaseline[cluster]'"
            ) from None
        try:
            client = Client(address, timeout=SECONDS_TO_CONNECT)
        except (OSError, ValueError, TypeError) as error:
            raise InputError(
                f"--scheduler {address}: no Dask scheduler answers there ({error}); "
                "give its address, such as tcp://host:8786"
            ) from None
        last: dict[str, ProgressEvent] = {}

        def receive(logged: tuple[float, Any]) -> None:
            event = ProgressEvent(*logged[1])
            last[event.worker] = event

        def submit(job: Job) -> Future:
            key = f"fgbaseline-{job.key}-{uuid4().hex[:8]}"
            future: Future = client.submit(work, job, send_to_scheduler, key=key, pure=False, retries=0)
            return future

        try:
            if not client.scheduler_info()["workers"]:
                raise InputError(f"--scheduler {address}: it has no workers; start some (dask worker ADDRESS)")
            client.subscribe_topic(TOPIC, receive)
            yield Workers(submit, lambda: list(last.values()))
        finally:
            with contextlib.suppress(Exception):
                client.unsubscribe_topic(TOPIC)
            client.close()

    return executor


def outcomes(jobs: Iterable[Job], executor: Executor, show: ShowProgress) -> Iterator[Outcome]:
    """Runs jobs and yields their outcomes as they end.

    A process that dies (a segmentation fault, out of memory) breaks the whole pool. The jobs that were running then run
    again, each alone in a process; one that dies again has failed.
    """
    left = {job.key: job for job in jobs}
    while left:
        with executor() as workers:
            with contextlib.suppress(BrokenProcessPool):
                for outcome in _until_one_dies(workers, list(left.values()), show):
                    del left[outcome.key]
                    yield outcome
            begun = {event.key for event in workers.events()}
        for job in [job for key, job in left.items() if key in begun or not begun & left.keys()]:
            with executor(1) as workers:
                try:
                    yield from _until_one_dies(workers, [job], show)
                except BrokenProcessPool as error:
                    yield _dead(job.key, error)
            del left[job.key]


def _until_one_dies(workers: Workers, jobs: list[Job], show: ShowProgress) -> Iterator[Outcome]:
    """Outcomes of the jobs; raises BrokenProcessPool where a pool of processes breaks, after those that have ended."""
    futures: dict[str, Future] = {job.key: workers.submit(job) for job in jobs}
    broken = None
    while futures and broken is None:
        time.sleep(POLL)
        show(workers.events())
        for key in [key for key, future in futures.items() if future.done()]:
            try:
                outcome = futures[key].result()
            except BrokenProcessPool as error:
                broken = error
                continue
            except Exception as error:
                outcome = _dead(key, error)
            del futures[key]
            yield outcome
    if broken is not None:
        raise broken


def _dead(key: str, error: Exception) -> Outcome:
    text = " ".join(str(error).split()) or "no text"
    failure = f"its process died, by a fault in compiled code or out of memory ({type(error).__name__}: {text})"
    return Outcome(key, {}, failure, 0.0)
