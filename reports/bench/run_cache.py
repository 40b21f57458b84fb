"""The folder of a bench: the runs that are done, each whole or not there at all, under the keys of their jobs."""

import fcntl
import json
import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fgbaseline.data.formats.named_file import shown
from fgbaseline.geometry import InputError

from .worker import Outcome

MARK = "bench.json"
"""the file by which a bench's folder is known"""
JOB = "job.json"
RUNS = "runs"
PARTIAL = ".partial"


@dataclass(frozen=True, slots=True)
class RunCache:
    """The folder, locked against other benches: see `opened`."""

    folder: Path

    def run(self, key: str) -> Path:
        """The folder of a run."""
        return self.folder / RUNS / key

    def done(self, key: str) -> bool:
        """Whether a job's outcome is here."""
        return (self.run(key) / JOB).is_file()

    def failure(self, key: str) -> str:
        """Why a job that is done has no run; empty where it has one."""
        return str(self.record(key)["failure"])

    def record(self, key: str) -> dict[str, Any]:
        """Failure and seconds of a job that is done."""
        record: dict[str, Any] = json.loads((self.run(key) / JOB).read_text(encoding="utf-8"))
        return record

    def keep(self, outcome: Outcome) -> None:
        """Writes the outcome of a job, all of it or nothing."""
        building = self.run(outcome.key).with_name(outcome.key + PARTIAL)
        shutil.rmtree(building, ignore_errors=True)
        record = {"failure": outcome.failure, "seconds": outcome.seconds}
        files = {**outcome.files, JOB: json.dumps(record).encode()}
        for name, content in files.items():
            path = building / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        building.rename(self.run(outcome.key))

    def write(self, name: str, content: bytes) -> None:
        """A file of the report, whole or as it was."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(path.name + PARTIAL)
        partial.write_bytes(content)
        partial.replace(path)

    def forget(self, *, but: Collection[str] = ()) -> None:
        """Removes all runs, those left half-written too, but the ones named."""
        for path in (self.folder / RUNS).iterdir():
            if path.name not in but:
                shutil.rmtree(path)


@contextmanager
def opened(folder: Path, *, force: bool) -> Iterator[RunCache]:
    """The folder of a bench, made or found, until the block ends; with `force` without the runs it held.

    Raises InputError for a folder that is none of ours, cannot be written, or that another bench is writing to.
    """
    try:
        if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / MARK).is_file())):
            raise InputError(
                f"{shown(folder)}: it exists and no bench wrote it (it has no {MARK}); choose another --out"
            )
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / MARK).open("a+") as mark:
            try:
                fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"{shown(folder)}: another bench is writing here; wait for it, or choose another --out"
                ) from None
            if os.fstat(mark.fileno()).st_size == 0:
                mark.write('{"schema": "fgbaseline/bench-folder/1"}\n')
                mark.flush()
            (folder / RUNS).mkdir(exist_ok=True)
            store = RunCache(folder)
            keep = () if force else [path.name for path in (folder / RUNS).iterdir() if (path / JOB).is_file()]
            store.forget(but=[name for name in keep if not name.endswith(PARTIAL)])
            yield store
    except OSError as error:
        raise InputError(
            f"{shown(folder)}: the folder cannot be written ({error.strerror or error}); choose another --out"
        ) from error
