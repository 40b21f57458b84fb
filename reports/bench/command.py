"""`fgbaseline bench`, from the suite's file to the report."""

from collections.abc import Mapping
from pathlib import Path

import click
from threadpoolctl import threadpool_limits

from fgbaseline.data.formats.named_file import shown

from ..phrases.bench import sentences
from ..results.bench import ANSWERED, Results
from .executors import Cluster, Executors, Processes, cores, outcomes
from .job import Planned
from .plan import plan
from .progress_events import board
from .run_cache import RunCache, opened
from .suite import read_suite

FAILED = 1


def bench(
    suite: Path,
    out: Path | None,
    *,
    data: Path | None,
    workers: int | None,
    scheduler: str | None,
    force: bool,
) -> int:
    """Runs the jobs that are left, writes the report, prints its sentences; returns the exit code: 1 for a failure."""
    read = read_suite(suite)
    planned = plan(read, data)
    name = read.content.name
    place = out or Path("out") / "bench" / name
    with opened(place, force=force) as store:
        executors = Processes(workers or cores(), store.folder) if scheduler is None else Cluster(scheduler)
        _do(planned, executors, store)
        with threadpool_limits(limits=1):
            results = _report(name, planned, store)
        store.forget(but={one.job.key for one in planned})
    for sentence in sentences(results):
        click.echo(sentence)
    click.echo(f"\nThe report is in {shown(place / 'report.html')}")
    return 0 if results.runs["status"].isin(ANSWERED).all() else FAILED


def _do(planned: list[Planned], executors: Executors, store: RunCache) -> None:
    """Every job that is not done; each is kept as it ends."""
    every: Mapping[str, Planned] = {one.job.key: one for one in planned}
    left = {key: one for key, one in every.items() if not store.done(key)}
    if len(left) < len(every):
        click.echo(f"{len(every) - len(left)} of {len(every)} runs are done already", err=True)
    if not left:
        return
    try:
        with board(left) as shows:
            for outcome in outcomes([one.job for one in left.values()], executors, shows.look):
                store.keep(outcome)
                shows.done(outcome)
    except KeyboardInterrupt:
        done = sum(map(store.done, every))
        click.echo(f"{done} of {len(every)} runs are kept; the same command goes on from there", err=True)
        raise


def _report(name: str, planned: list[Planned], store: RunCache) -> Results:
    from .report import collected, write_report  # matplotlib, half a second: not before there is something to draw

    results = collected(planned, store)
    write_report(name, results, store)
    return results
