"""Cache of finished runs in the folder of a bench, each written atomically under the key of its job."""

import fcntl
import json
import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.formats.file_errors import shown
from fgbaseline.geometry import InputError

from .worker import Outcome

MARK = "bench.json"
"""the file that marks a bench's folder"""
JOB = "job.json"
RUNS = "runs"
PARTIAL = ".partial"


@dataclass(frozen=True, slots=True)
class RunCache:
    """The folder, locked against other benches: see `open_cache`."""

    folder: Path

    def run(self, key: str) -> Path:
        """The folder of a run."""
        return self.folder / RUNS / key

    def has(self, key: str) -> bool:
        """Whether the outcome of a job is stored."""
        return (self.run(key) / JOB).is_file()

    def record(self, key: str) -> dict[str, Any]:
        """Failure (empty where there is a run) and seconds of a finished job."""
        record: dict[str, Any] = json.loads((self.run(key) / JOB).read_text(encoding="utf-8"))
        return record

    def store(self, outcome: Outcome) -> None:
        """Writes the outcome of a job atomically."""
        building = self.run(outcome.key).with_name(outcome.key + PARTIAL)
        shutil.rmtree(building, ignore_errors=True)
        record = {"failure": outcome.failure, "seconds": outcome.seconds}
        for name, content in {**outcome.files, JOB: json.dumps(record).encode()}.items():
            path = building / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        building.rename(self.run(outcome.key))

    def write(self, name: str, content: bytes) -> None:
        """Writes a file of the report atomically."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as file:
            file.write(content)

    def remove_runs(self, *, keep: Collection[str] = ()) -> None:
        """Removes all runs except those to keep, and half-written ones."""
        for path in (self.folder / RUNS).iterdir():
            if path.name not in keep:
                shutil.rmtree(path)


@contextmanager
def open_cache(folder: Path, *, force: bool) -> Iterator[RunCache]:
    """Opens or creates the folder of a bench for the block; with `force` its runs are removed.

    Raises InputError for a folder of something else, one that cannot be written, or one that another bench writes to.
    """
    try:
        if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / MARK).is_file())):
            raise InputError(
                f"{shown(folder)}: it exists and is not the folder of a bench (it has no {MARK}); choose another --out"
            )
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / MARK).open("a+") as mark:
            try:
                fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"{shown(folder)}: another bench is writing to it; wait for that, or choose another --out"
                ) from None
            if os.fstat(mark.fileno()).st_size == 0:
                mark.write('{"schema": "fgbaseline/bench-folder/1"}\n')
                mark.flush()
            (folder / RUNS).mkdir(exist_ok=True)
            cache = RunCache(folder)
            names = [] if force else [path.name for path in (folder / RUNS).iterdir()]
            cache.remove_runs(keep=[name for name in names if cache.has(name) and not name.endswith(PARTIAL)])
            yield cache
    except OSError as error:
        raise InputError(
            f"{shown(folder)}: the folder cannot be written ({error.strerror or error}); choose another --out"
        ) from error
