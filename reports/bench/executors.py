"""Who does the jobs: processes of this machine, or the workers of a Dask cluster."""

import contextlib
import os
import shutil
import signal
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, Protocol
from uuid import uuid4

from fgbaseline.geometry import InputError

from .channels import TOPIC, EventChannel, FileChannel, Tiding
from .job import Job
from .work import Outcome, work

if TYPE_CHECKING:
    from distributed import Client

ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}
SECONDS_TO_CONNECT = 5
SECONDS_TO_FOLLOW = 0.5
PROGRESS = "progress"


class Future(Protocol):
    """An outcome that is to come."""

    def done(self) -> bool:
        """Whether it has come."""
        ...

    def result(self) -> Outcome:
        """It, or what was raised in its place."""
        ...


class Crew(Protocol):
    """Workers."""

    def submit(self, job: Job) -> Future:
        """Gives them a job."""
        ...

    def tidings(self) -> Iterator[Tiding]:
        """The last that each of them told."""
        ...


class Hire(Protocol):
    """How to get workers, and to be rid of them."""

    def __call__(self, count: int | None = None, /) -> AbstractContextManager[Crew]:
        """So many of them (None: as many as there are to be had)."""
        ...


class _Processes:
    def __init__(self, executor: Any, channel: FileChannel) -> None:
        self._executor, self._channel = executor, channel

    def submit(self, job: Job) -> Future:
        future: Future = self._executor.submit(work, job, self._channel)
        return future

    def tidings(self) -> Iterator[Tiding]:
        return self._channel.tidings()


class Processes:
    """Processes of this machine, that share nothing, with one BLAS thread each."""

    def __init__(self, workers: int, folder: Path) -> None:
        self._workers, self._folder = workers, folder / PROGRESS

    @contextmanager
    def __call__(self, count: int | None = None) -> Iterator[Crew]:
        """New processes, that end with the block, if need be at once."""
        from joblib.externals.loky import ProcessPoolExecutor

        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir()
        executor = ProcessPoolExecutor(
            count or self._workers, env=ONE_THREAD, initializer=_follow, initargs=(os.getpid(),)
        )
        try:
            yield _Processes(executor, FileChannel(self._folder))
        finally:
            executor.shutdown(wait=True, kill_workers=True)
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
        self._told: dict[str, Tiding] = {}
        client.subscribe_topic(TOPIC, self._hear)

    def submit(self, job: Job) -> Future:
        key = f"fgbaseline-{job.key}-{uuid4().hex[:8]}"
        future: Future = self._client.submit(work, job, EventChannel(), key=key, pure=False, retries=0)
        return future

    def tidings(self) -> Iterator[Tiding]:
        return iter(list(self._told.values()))

    def _hear(self, event: tuple[float, Any]) -> None:
        tiding = Tiding(*event[1])
        self._told[tiding.worker] = tiding


class Cluster:
    """The workers of a Dask scheduler that is running."""

    def __init__(self, address: str) -> None:
        self._address = address

    @contextmanager
    def __call__(self, count: int | None = None) -> Iterator[Crew]:  # noqa: ARG002
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
