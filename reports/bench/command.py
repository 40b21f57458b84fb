"""`fgbaseline bench`: suite file, jobs, report, and exit code."""

from collections.abc import Mapping
from pathlib import Path

import click
from threadpoolctl import threadpool_limits

from fgbaseline.data.formats.file_errors import shown
from fgbaseline.data.wording import plural

from ..phrases.bench import sentences
from ..results.bench import ANSWERED
from .executors import Executor, cluster, cores, outcomes, processes
from .job import Planned
from .plan import plan
from .progress import progress_display
from .run_cache import RunCache, open_cache
from .suite import read_suite

FAILED = 1


def bench(
    suite: Path, out: Path | None, *, data: Path | None, workers: int | None, scheduler: str | None, force: bool
) -> int:
    """Runs the remaining jobs, writes the report, prints its sentences; returns 1 where an estimator failed, else 0."""
    read = read_suite(suite)
    planned = plan(read, data)
    name = read.content.name
    place = out or Path("out") / "bench" / name
    with open_cache(place, force=force) as cache:
        executor = processes(workers or cores(), cache.folder) if scheduler is None else cluster(scheduler)
        _run_jobs(planned, executor, cache)
        with threadpool_limits(limits=1):
            from .report import collect_results, write_report  # matplotlib: not before there is something to draw

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
