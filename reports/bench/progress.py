"""Progress of a bench on standard error: the whole, every worker, and the time left."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from .channels import Tiding
from .job import Planned
from .work import Outcome

WHOLE_BENCH = 1e9
"""s over which the speed of the whole is averaged"""


class Board(Protocol):
    """Where progress is shown."""

    def look(self, tidings: Iterable[Tiding], /) -> None:
        """What workers are doing."""
        ...

    def done(self, outcome: Outcome, /) -> None:
        """A job has ended."""
        ...


class LineBoard:
    """For a file or a pipe: a line for every job that has ended."""

    def __init__(self, jobs: Mapping[str, Planned]) -> None:
        self._jobs, self._start = jobs, time.monotonic()
        self._work = sum(planned.work for planned in jobs.values())
        self._worked, self._ended = 0.0, 0

    def look(self, tidings: Iterable[Tiding]) -> None:
        """Says nothing."""

    def done(self, outcome: Outcome) -> None:
        """A line, with the time left by the work that is done."""
        planned = self._jobs[outcome.key]
        self._worked, self._ended = self._worked + planned.work, self._ended + 1
        left = (time.monotonic() - self._start) * (self._work / self._worked - 1.0) if self._worked else 0.0
        about = f", about {duration(left)} left" if self._ended < len(self._jobs) else ""
        print(f"{self._ended} of {len(self._jobs)}{about}: {told(planned, outcome)}", file=sys.stderr, flush=True)


class BarBoard:
    """For a terminal: a bar for the whole, and one for each worker."""

    def __init__(
        self, jobs: Mapping[str, Planned], whole: Progress, each: Progress, say: Callable[[str], None]
    ) -> None:
        self._jobs, self._whole, self._each, self._say = jobs, whole, each, say
        self._ended = 0
        self._task = whole.add_task(self._count(), total=sum(planned.work for planned in jobs.values()))
        self._rows: dict[str, tuple[TaskID, str]] = {}

    def _count(self) -> str:
        return f"{self._ended} of {len(self._jobs)} runs"

    def look(self, tidings: Iterable[Tiding]) -> None:
        """Moves the bars of the workers."""
        for tiding in tidings:
            name = self._jobs[tiding.key].name if tiding.key in self._jobs else ""
            text = f"  {name}: {tiding.doing}" if name else "  waiting"
            row, before = self._rows.get(tiding.worker, (None, ""))
            if row is None:
                row = self._each.add_task(text, total=None)
            elif before != text:
                self._each.reset(row, total=None, description=text)
            self._rows[tiding.worker] = (row, text)
            self._each.update(row, completed=tiding.done, total=tiding.total or None)

    def done(self, outcome: Outcome) -> None:
        """A line above the bars for one that failed; moves the bar of the whole."""
        planned = self._jobs[outcome.key]
        self._ended += 1
        self._whole.update(self._task, advance=planned.work, description=self._count())
        if outcome.failure:
            self._say(told(planned, outcome))


def told(planned: Planned, outcome: Outcome) -> str:
    """How a job ended, in a line."""
    return f"{planned.name}: " + (f"failed: {outcome.failure}" if outcome.failure else duration(outcome.seconds))


def duration(seconds: float) -> str:
    """Such as `3.2 s`, `12 min` or `3.4 h`."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 6000.0 else f"{seconds / 3600.0:.2g} h"


@contextmanager
def board(jobs: Mapping[str, Planned]) -> Iterator[Board]:
    """The one that fits standard error, for the jobs by key that are still to be done."""
    if not sys.stderr.isatty():
        yield LineBoard(jobs)
        return
    from rich.console import Group
    from rich.live import Live

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    whole, each = Progress(*columns, console=console, speed_estimate_period=WHOLE_BENCH), Progress(*columns)
    with Live(Group(whole, each), console=console, refresh_per_second=4):
        yield BarBoard(jobs, whole, each, lambda text: console.print(text, markup=False, highlight=False))
