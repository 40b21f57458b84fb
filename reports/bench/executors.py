"""Executors of jobs: processes of this machine, or the workers of a Dask cluster; and their outcomes."""

import contextlib
import os
import shutil
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, Protocol
from uuid import uuid4

from fgbaseline.geometry import InputError

from .job import Job
from .progress_events import TOPIC, EventChannel, FileChannel, ProgressEvent
from .worker import Outcome, work

if TYPE_CHECKING:
    from distributed import Client

ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}
SECONDS_TO_CONNECT = 5
SECONDS_TO_FOLLOW = 0.5
PROGRESS = "progress"
POLL = 0.1
"""s between two looks at the jobs"""
Look = Callable[[Iterable[ProgressEvent]], None]
"""takes the progress of the workers, regularly"""


class Future(Protocol):
    """An outcome that is to come."""

    def done(self) -> bool:
        """Whether it has come."""
        ...

    def result(self) -> Outcome:
        """It, or what was raised in its place."""
        ...


class Executor(Protocol):
    """Workers."""

    def submit(self, job: Job) -> Future:
        """Gives them a job."""
        ...

    def events(self) -> Iterator[ProgressEvent]:
        """The last event of each of them."""
        ...


class Executors(Protocol):
    """Starts workers, and ends them with the block."""

    def __call__(self, count: int | None = None, /) -> AbstractContextManager[Executor]:
        """So many of them (None: as many as there are to be had)."""
        ...


class _Processes:
    def __init__(self, pool: Any, channel: FileChannel) -> None:
        self._pool, self._channel = pool, channel

    def submit(self, job: Job) -> Future:
        future: Future = self._pool.submit(work, job, self._channel)
        return future

    def events(self) -> Iterator[ProgressEvent]:
        return self._channel.events()


class Processes:
    """Processes of this machine, that share nothing, with one BLAS thread each."""

    def __init__(self, workers: int, folder: Path) -> None:
        self._workers, self._folder = workers, folder / PROGRESS

    @contextmanager
    def __call__(self, count: int | None = None) -> Iterator[Executor]:
        """New processes, that end with the block, if need be at once."""
        from joblib.externals.loky import ProcessPoolExecutor

        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir()
        pool = ProcessPoolExecutor(count or self._workers, env=ONE_THREAD, initializer=_follow, initargs=(os.getpid(),))
        try:
            yield _Processes(pool, FileChannel(self._folder))
        finally:
            pool.shutdown(wait=True, kill_workers=True)
            shutil.rmtree(self._folder, ignore_errors=True)


def _follow(parent: int) -> None:
    """Within a worker: leaves interrupts to the parent, and ends when that has been killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(SECONDS_TO_FOLLOW)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


class _Workers:
    def __init__(self, client: "Client") -> None:
        self._client = client
        self._last: dict[str, ProgressEvent] = {}
        client.subscribe_topic(TOPIC, self._hear)

    def submit(self, job: Job) -> Future:
        key = f"fgbaseline-{job.key}-{uuid4().hex[:8]}"
        future: Future = self._client.submit(work, job, EventChannel(), key=key, pure=False, retries=0)
        return future

    def events(self) -> Iterator[ProgressEvent]:
        return iter(list(self._last.values()))

    def _hear(self, logged: tuple[float, Any]) -> None:
        event = ProgressEvent(*logged[1])
        self._last[event.worker] = event


class Cluster:
    """The workers of a Dask scheduler that is running."""

    def __init__(self, address: str) -> None:
        self._address = address

    @contextmanager
    def __call__(self, count: int | None = None) -> Iterator[Executor]:  # noqa: ARG002
        """All of its workers. Raises InputError where it cannot be reached or has none."""
        try:
            from distributed import Client
        except ImportError:
            raise InputError(
                "--scheduler needs Dask, which is not installed; pip install 'fgbaseline[cluster]'"
            ) from None
        try:
            client = Client(self._address, timeout=SECONDS_TO_CONNECT)
        except (OSError, ValueError, TypeError) as error:
            raise InputError(
                f"--scheduler {self._address}: no Dask scheduler answers there ({error}); "
                "give its address, such as tcp://host:8786"
            ) from None
        try:
            if not client.scheduler_info()["workers"]:
                raise InputError(f"--scheduler {self._address}: it has no workers; start some (dask worker ADDRESS)")
            yield _Workers(client)
        finally:
            with contextlib.suppress(Exception):
                client.unsubscribe_topic(TOPIC)
            client.close()


def cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def outcomes(jobs: Iterable[Job], executors: Executors, look: Look) -> Iterator[Outcome]:
    """The outcome of every job, as they come.

    Where a process dies and takes the others with it (a segmentation fault, or no memory left), those jobs that were
    being done are done again, each alone in a process; the one that dies again has failed.
    """
    left = {job.key: job for job in jobs}
    while left:
        with executors() as executor:
            for outcome in _until_one_dies(executor, list(left.values()), look):
                del left[outcome.key]
                yield outcome
            begun = {event.key for event in executor.events()}
        for job in [job for key, job in left.items() if key in begun or not begun & left.keys()]:
            yield _alone(job, executors, look)
            del left[job.key]


def _until_one_dies(executor: Executor, jobs: list[Job], look: Look) -> Iterator[Outcome]:
    futures: dict[str, Future] = {job.key: executor.submit(job) for job in jobs}
    dead = False
    while futures and not dead:
        time.sleep(POLL)
        look(executor.events())
        for key in [key for key, future in futures.items() if future.done()]:
            try:
                outcome = futures[key].result()
            except Exception as error:
                if not _is_the_end_of_all(error):
                    yield Outcome(key, {}, _died(error), 0.0)
                    del futures[key]
                dead = dead or _is_the_end_of_all(error)
                continue
            del futures[key]
            yield outcome


def _alone(job: Job, executors: Executors, look: Look) -> Outcome:
    with executors(1) as executor:
        future = executor.submit(job)
        while not future.done():
            time.sleep(POLL)
            look(executor.events())
        try:
            return future.result()
        except Exception as error:
            return Outcome(job.key, {}, _died(error), 0.0)


def _is_the_end_of_all(error: Exception) -> bool:
    """Whether the executor is of no more use: a pool of processes is broken as a whole, a cluster is not."""
    from concurrent.futures.process import BrokenProcessPool

    return isinstance(error, BrokenProcessPool)


def _died(error: Exception) -> str:
    said = " ".join(str(error).split()) or "no text"
    return f"its process died, as from a fault in compiled code or for want of memory ({type(error).__name__}: {said})"
