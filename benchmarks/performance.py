"""Everything that is claimed of speed and memory, in one run and one table: `python -m benchmarks.performance`.

Writes docs/performance.md between its marks, and the figure beside it. A number is worth as much as the machine was
idle.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import platform
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path

import click

from . import docs_table, filters, growth, growth_figure, long_run, reader_cost, reference_speed, run_overhead
from .claim_table import Row, table

PLACE = Path("docs/performance.md")
RECORDING = "03.npz"
QUICK_DRIVE, QUICK_RUN = 600, 100
"""frames"""


def parts(recording: Path | None, runs: int, quick: bool) -> Iterator[tuple[str, Callable[[], list[Row]]]]:
    """Benchmarks, in order, by name."""
    drive, run = (QUICK_DRIVE, QUICK_RUN) if quick else (reference_speed.DRIVE_FRAMES, long_run.FRAMES)
    if recording is not None:
        yield "filters", lambda: filters.rows(recording, runs)
    yield "reference_speed", lambda: reference_speed.rows(recording, runs, drive)
    if recording is not None:
        yield "rest_of_run", lambda: run_overhead.rows(recording, runs)
    yield "reader_cost", lambda: reader_cost.rows(runs)
    yield "long_run", lambda: long_run.rows(run)


def machine() -> str:
    """Machine and versions, in a sentence."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "gtsam"))
    return (
        f"Measured on {os.cpu_count()} cores of {_processor()}, {_memory()}, Python {platform.python_version()}, "
        f"{packages}; BLAS with one thread; load {os.getloadavg()[0]:.1f} at the start."
    )


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.processor() or platform.machine())


def _memory() -> str:
    return f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 1e9:.0f} GB"


@click.command()
@click.option("--recordings", type=click.Path(file_okay=False, path_type=Path), default="../shared/data")
@click.option("--runs", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--quick", is_flag=True, help="Small sizes, for trying: no figure is written, and docs only if --write.")
@click.option("--write/--no-write", "wanted", default=None, help="Write docs/performance.md.  [default: unless quick]")
@click.option(
    "--figure", type=click.Path(dir_okay=False, path_type=Path), help="Where to draw the growth, if anywhere."
)
def main(recordings: Path, runs: int, quick: bool, wanted: bool | None, figure: Path | None) -> None:
    """Measure everything, print the table and write it down."""
    notes = [machine()]
    recording: Path | None = recordings / RECORDING
    if not (recordings / RECORDING).is_file():
        recording = None
        notes.append(f"{RECORDING} is not in {recordings}: filters, run_overhead and isam2 on it are left out.")
    if quick:
        notes.append("A quick run, on small sizes: for trying, and no verdict.")
    rows: list[Row] = []
    for name, measure in parts(recording, runs, quick):
        start = time.monotonic()
        rows += measure()
        click.echo(f"{name}: {time.monotonic() - start:.0f} s", err=True)
    points = growth.measured(quick)
    text = "\n\n".join([" ".join(notes), table(rows), growth.tables(points, growth.axes(quick))])
    click.echo(text)
    if wanted or (wanted is None and not quick):
        docs_table.write(PLACE, "performance", [text])
        click.echo(f"\n{PLACE} is written", err=True)
        if figure is not None:
            figure.write_bytes(growth_figure.drawn(points))


if __name__ == "__main__":
    main()
