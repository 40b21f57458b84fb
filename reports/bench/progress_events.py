"""How workers tell of their progress: through small files on this machine, through events on a Dask cluster."""

import contextlib
import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

TOPIC = "fgbaseline-bench"
INTERVAL = 0.3
"""s between two tidings of the same work"""


@dataclass(frozen=True, slots=True)
class Tiding:
    """What a worker is doing."""

    worker: str
    key: str
    """of its job; empty while it has none"""
    doing: str
    """an estimator's name, or `reading` and `writing`"""
    done: int
    total: int
    """frames; 0 where they are not counted"""


@dataclass(frozen=True, slots=True)
class FileChannel:
    """A file for each process in a folder."""

    folder: Path

    def __call__(self, key: str, doing: str, done: int, total: int) -> None:
        """Tells of progress, at most every `INTERVAL`."""
        if not _due(key, doing):
            return
        place = self.folder / str(os.getpid())
        partial = place.with_suffix(".partial")
        with contextlib.suppress(OSError):  # nobody may be listening any more
            partial.write_text(json.dumps([key, doing, done, total]))
            partial.replace(place)

    def tidings(self) -> Iterator[Tiding]:
        """The last of each worker."""
        for place in sorted(self.folder.iterdir()):
            if place.suffix == "":
                with contextlib.suppress(OSError, ValueError):
                    yield Tiding(place.name, *json.loads(place.read_text()))


@dataclass(frozen=True, slots=True)
class EventChannel:
    """Events of a Dask worker, which the scheduler hands on."""

    def __call__(self, key: str, doing: str, done: int, total: int) -> None:
        """Tells of progress, at most every `INTERVAL`."""
        if not _due(key, doing):
            return
        from distributed import get_worker

        worker = get_worker()
        worker.log_event(TOPIC, [worker.name, key, doing, done, total])


_last = ("", "", 0.0)


def _due(key: str, doing: str) -> bool:
    """Whether the work is another, or the last tiding of it old enough; then it counts as told."""
    global _last
    now = time.monotonic()
    if _last[:2] == (key, doing) and now - _last[2] < INTERVAL:
        return False
    _last = (key, doing, now)
    return True
