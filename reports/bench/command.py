"""`fgbaseline bench`: suite file, jobs with a display of their progress, report, and exit code."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import click
from joblib import cpu_count
from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from threadpoolctl import threadpool_limits

from fgbaseline.data.formats.files.file_errors import shown
from fgbaseline.data.wording import plural

from ..phrases.bench import duration, sentences
from ..results.bench import ANSWERED, Planned
from .executors import Executor, ProgressEvent, cluster, outcomes, processes
from .folder import RunCache, collect_results, open_cache, write_report
from .plan import plan
from .suite import read_suite
from .worker import Outcome

FAILED = 1
WHOLE_BENCH = 1e9
"""s over which the total speed is averaged"""


def bench(
    suite: Path, out: Path | None, *, data: Path | None, workers: int | None, scheduler: str | None, force: bool
) -> int:
    """Runs the remaining jobs, writes the report, prints its sentences; returns 1 where an estimator failed, else 0."""
    read = read_suite(suite)
    planned = plan(read, data)
    name = read.content.name
    place = out or Path("out") / "bench" / name
    with open_cache(place, force=force) as cache:
        executor = processes(workers or cpu_count(), cache.folder) if scheduler is None else cluster(scheduler)
        _run_jobs(planned, executor, cache)
        with threadpool_limits(limits=1):
            results = collect_results(planned, cache)
            write_report(name, results, cache)
        cache.remove_runs(keep={one.job.key for one in planned})
    for sentence in sentences(results):
        click.echo(sentence)
    click.echo(f"\nThe report is in {shown(place / 'report.html')}")
    return 0 if results.runs["status"].isin(ANSWERED).all() else FAILED


def _run_jobs(planned: list[Planned], executor: Executor, cache: RunCache) -> None:
    """Runs every job that is not in the cache, and stores each outcome when it ends."""
    every: Mapping[str, Planned] = {one.job.key: one for one in planned}
    left = {key: one for key, one in every.items() if not cache.has(key)}
    if len(left) < len(every):
        click.echo(f"{len(every) - len(left)} of {plural(len(every), 'run')} done already", err=True)
    if not left:
        return
    try:
        with progress_display(left) as display:
            for outcome in outcomes([one.job for one in left.values()], executor, display.update):
                cache.store(outcome)
                display.finish(outcome)
    except KeyboardInterrupt:
        done = sum(map(cache.has, every))
        click.echo(f"{done} of {plural(len(every), 'run')} kept; the same command resumes from there", err=True)
        raise


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
        click.echo(f"{self._ended} of {len(self._jobs)}{about}: {_summary_line(planned, outcome)}", err=True)


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
            self._print_line(_summary_line(planned, outcome))


def _summary_line(planned: Planned, outcome: Outcome) -> str:
    return f"{planned.name}: " + (f"failed: {outcome.failure}" if outcome.failure else duration(outcome.seconds))


@contextmanager
def progress_display(jobs: Mapping[str, Planned]) -> Iterator[LineDisplay | BarDisplay]:
    """The display for this standard error, of the remaining jobs by key."""
    if not sys.stderr.isatty():
        yield LineDisplay(jobs)
        return
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    whole, each = Progress(*columns, console=console, speed_estimate_period=WHOLE_BENCH), Progress(*columns)
    with Live(Group(whole, each), console=console, refresh_per_second=4):
        yield BarDisplay(jobs, whole, each, lambda text: console.print(text, markup=False, highlight=False))
