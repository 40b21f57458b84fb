"""`fgbaseline bench`, from the suite's file to the report."""

from collections.abc import Mapping
from pathlib import Path

import click
from threadpoolctl import threadpool_limits

from fgbaseline.data.formats.named_file import shown

from .crews import Cluster, Hire, Processes, cores
from .job import Planned
from .plan import plan
from .progress import board
from .results import ANSWERED, Results, collected
from .schedule import outcomes
from .store import Store, opened
from .suite import read_suite
from .wording import sentences

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
    """Runs what is not done yet, writes the report and tells of it; gives the exit code: 1 where anything failed."""
    read = read_suite(suite)
    planned = plan(read, data)
    name = read.content.name
    place = out or Path("out") / "bench" / name
    with opened(place, force=force) as store:
        hire = Processes(workers or cores(), store.folder) if scheduler is None else Cluster(scheduler)
        _do(planned, hire, store)
        with threadpool_limits(limits=1):
            results = collected(planned, store)
            _report(name, results, store)
        store.forget(but={one.job.key for one in planned})
    for sentence in sentences(results):
        click.echo(sentence)
    click.echo(f"\nThe report is in {shown(place / 'report.html')}")
    return 0 if results.runs["status"].isin(ANSWERED).all() else FAILED


def _do(planned: list[Planned], hire: Hire, store: Store) -> None:
    """Every job that is not done; each is kept as it ends."""
    every: Mapping[str, Planned] = {one.job.key: one for one in planned}
    left = {key: one for key, one in every.items() if not store.done(key)}
    if len(left) < len(every):
        click.echo(f"{len(every) - len(left)} of {len(every)} runs are done already", err=True)
    if not left:
        return
    try:
        with board(left) as shows:
            for outcome in outcomes([one.job for one in left.values()], hire, shows.look):
                store.keep(outcome)
                shows.done(outcome)
    except KeyboardInterrupt:
        done = sum(map(store.done, every))
        click.echo(f"{done} of {len(every)} runs are kept; the same command goes on from there", err=True)
        raise


def _report(name: str, results: Results, store: Store) -> None:
    from .report import write_report  # matplotlib, half a second: not before there is something to draw

    write_report(name, results, store)
