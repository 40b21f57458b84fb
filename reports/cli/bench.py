"""`fgbaseline bench`: many sequences, settings and seeds."""

from pathlib import Path

import click


@click.command(epilog="Example: fgbaseline bench suites/quick.toml --out out/bench/quick")
@click.argument("suite", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder to write.  [default: out/bench/NAME]")
@click.option(
    "--data",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="Where the suite's relative paths begin.  [default: the suite's folder]",
)
@click.option("--workers", type=click.IntRange(min=1), help="Processes.  [default: one for each core]")
@click.option("--scheduler", metavar="ADDRESS", help="Run on this Dask cluster instead (fgbaseline[cluster]).")
@click.option("--force", is_flag=True, help="Run anew what is done already.")
def command(
    suite: Path,
    out: Path | None,
    data: Path | None,
    workers: int | None,
    scheduler: str | None,
    force: bool,
) -> int:
    """Run every sequence, setting and seed that SUITE (TOML) names, and write a benchmark report.

    What is done is kept: the same command goes on where an interrupted one ended, and runs anew only what has changed
    (a recording, a setting, our source). docs/bench.md describes suites and report.

    Exits 0 when every estimator gave an answer in every run, 1 when one failed, 2 on bad input.
    """
    from fgbaseline.geometry import InputError

    from ..bench.command import bench

    if workers is not None and scheduler is not None:
        raise InputError("--workers is for this machine, and a cluster has its own; leave it out with --scheduler")
    return bench(suite, out, data=data, workers=workers, scheduler=scheduler, force=force)
