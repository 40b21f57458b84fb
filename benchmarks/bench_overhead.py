"""Overhead of `bench` over its runs: many short ones on two workers of Dask, beside their own seconds.

`python -m benchmarks.bench_overhead --runs 1000` prints JSON. A worker that does nothing but runs is always busy, so
the seconds of two workers from the first job to the last, less those of the runs, are what it costs to plan, to send,
to store and to show them. Both go by the same clock: other work on the machine slows both.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import json
import time
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

import click
from distributed import LocalCluster

from fgbaseline.reports.bench.executors import ProgressEvent, cluster, outcomes
from fgbaseline.reports.bench.folder import open_cache
from fgbaseline.reports.bench.plan import plan
from fgbaseline.reports.bench.suite import read_suite

WORKERS = 2
SUITE = """
name = "short"
estimators = ["dead-reckoning", "ekf", "isam2"]
page = "none"
[[sequence]]
name = "drive"
simulate = {{ duration = 2.0, features_per_frame = 10 }}
seeds = {{ count = {runs} }}
"""


def silent(events: Iterable[ProgressEvent]) -> None:
    """Shows nothing."""


def measured(runs: int) -> dict[str, float]:
    """Seconds of both workers for the jobs after the first of each, which starts them, and of these jobs themselves."""
    with (
        TemporaryDirectory(prefix="fgbaseline-") as place,
        LocalCluster(n_workers=WORKERS, threads_per_worker=1, dashboard_address=None) as workers,
    ):
        file = Path(place) / "suite.toml"
        file.write_text(SUITE.format(runs=runs + 2 * WORKERS), encoding="utf-8")
        jobs = [planned.job for planned in plan(read_suite(file), None)]
        executor = cluster(workers.scheduler_address)
        warm = list(outcomes(jobs[: 2 * WORKERS], executor, silent))
        with open_cache(Path(place) / "out", force=False) as cache:
            start, own = time.perf_counter(), 0.0
            for outcome in outcomes(jobs[2 * WORKERS :], executor, silent):
                cache.store(outcome)
                own += outcome.seconds
            taken = WORKERS * (time.perf_counter() - start)
    failures = [outcome.failure for outcome in warm if outcome.failure]
    if failures:
        raise RuntimeError(failures[0])
    return {"runs": runs, "workers": taken, "own": own, "ratio": taken / own}


@click.command()
@click.option("--runs", type=click.IntRange(min=10), default=1000, show_default=True)
def main(runs: int) -> None:
    """Time a bench and its runs."""
    click.echo(json.dumps(measured(runs)))


if __name__ == "__main__":
    main()
