"""Progress of workers, sent through files on this machine or Dask events, and its display on standard error."""

import contextlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from .job import Planned
from .worker import Outcome

TOPIC = "fgbaseline-bench"
WHOLE_BENCH = 1e9
"""s over which the total speed is averaged"""
INTERVAL = 0.3
"""s between two events of the same step"""


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
        if not _is_due(key, doing):
            return
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


@dataclass(frozen=True, slots=True)
class EventChannel:
    """Channel of Dask events, which the scheduler forwards."""

    def __call__(self, key: str, doing: str, done: int, total: int) -> None:
        """Reports progress, at most every `INTERVAL`."""
        if not _is_due(key, doing):
            return
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


class LineDisplay:
    """Progress in a file or a pipe: a line for every finished job."""

    def __init__(self, jobs: Mapping[str, Planned]) -> None:
        self._jobs, self._start = jobs, time.monotonic()
        self._work = sum(planned.work for planned in jobs.values())
        self._worked, self._ended = 0.0, 0

    def update(self, events: Iterable[ProgressEvent]) -> None:
        """Prints nothing."""

    def finish(self, outcome: Outcome) -> None:
        """Prints a line with the remaining time."""
        planned = self._jobs[outcome.key]
        self._worked, self._ended = self._worked + planned.work, self._ended + 1
        left = (time.monotonic() - self._start) * (self._work / self._worked - 1.0) if self._worked else 0.0
        about = f", about {duration(left)} left" if self._ended < len(self._jobs) else ""
        print(
            f"{self._ended} of {len(self._jobs)}{about}: {summary_line(planned, outcome)}", file=sys.stderr, flush=True
        )


class BarDisplay:
    """Progress on a terminal: a bar for all jobs, and one for each worker."""

    def __init__(
        self, jobs: Mapping[str, Planned], whole: Progress, each: Progress, print_line: Callable[[str], None]
    ) -> None:
        self._jobs, self._whole, self._each, self._print_line = jobs, whole, each, print_line
        self._ended = 0
        self._task = whole.add_task(self._count(), total=sum(planned.work for planned in jobs.values()))
        self._rows: dict[str, tuple[TaskID, str]] = {}

    def _count(self) -> str:
        return f"{self._ended} of {len(self._jobs)} runs"

    def update(self, events: Iterable[ProgressEvent]) -> None:
        """Moves the bars of the workers."""
        for event in events:
            name = self._jobs[event.key].name if event.key in self._jobs else ""
            text = f"  {name}: {event.doing}" if name else "  waiting"
            row, before = self._rows.get(event.worker, (None, ""))
            if row is None:
                row = self._each.add_task(text, total=None)
            elif before != text:
                self._each.reset(row, total=None, description=text)
            self._rows[event.worker] = (row, text)
            self._each.update(row, completed=event.done, total=event.total or None)

    def finish(self, outcome: Outcome) -> None:
        """Moves the bar of all jobs; prints a line above the bars for a failure."""
        planned = self._jobs[outcome.key]
        self._ended += 1
        self._whole.update(self._task, advance=planned.work, description=self._count())
        if outcome.failure:
            self._print_line(summary_line(planned, outcome))


def summary_line(planned: Planned, outcome: Outcome) -> str:
    """Outcome of a job in one line."""
    return f"{planned.name}: " + (f"failed: {outcome.failure}" if outcome.failure else duration(outcome.seconds))


def duration(seconds: float) -> str:
    """Duration as text: `3.2 s`, `12 min` or `3.4 h`."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 6000.0 else f"{seconds / 3600.0:.2g} h"


@contextmanager
def progress_display(jobs: Mapping[str, Planned]) -> Iterator[LineDisplay | BarDisplay]:
    """The display for this standard error, of the remaining jobs by key."""
    if not sys.stderr.isatty():
        yield LineDisplay(jobs)
        return
    from rich.console import Group
    from rich.live import Live

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    whole, each = Progress(*columns, console=console, speed_estimate_period=WHOLE_BENCH), Progress(*columns)
    with Live(Group(whole, each), console=console, refresh_per_second=4):
        yield BarDisplay(jobs, whole, each, lambda text: console.print(text, markup=False, highlight=False))
