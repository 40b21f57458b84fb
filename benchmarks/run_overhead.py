"""Time of a run outside its estimators: `python -m benchmarks.run_overhead drive.npz --runs 3`.

Each run is a process of its own, so that imports count. What is wanted is asked of all that is not an estimator:
imports, reading, posing (the diagnosis), comparison, figures, tables and page, in the order and with the forks of
`reports/run/command.py`. Seconds are of the clock on the wall; a figure is worth as much as the machine was idle.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):  # as the command line has it
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import gc
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from benchmarks.claim_table import Row, table
from fgbaseline.reports.cli import NEW_OBJECTS
from fgbaseline.reports.problem import DEFAULT_ESTIMATORS

WANTED = 8.0
"""s, of all that is not an estimator"""
SOLVING = "solving: "
"""how the names of stages begin that are an estimator's work"""
POSING = "posing, and imports meanwhile"


def stages(recording: Path, estimators: tuple[str, ...]) -> dict[str, float]:
    """Seconds of each stage of one run in this process, in their order."""
    taken: dict[str, float] = {}
    gc.set_threshold(NEW_OBJECTS)  # as the command line has it

    @contextmanager
    def watch(stage: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        taken[stage] = time.perf_counter() - start

    with watch("imports"):
        from fgbaseline.data.parallel import background_map, cores
        from fgbaseline.reports import progress  # noqa: F401
        from fgbaseline.reports.problem.construction import build_problem, read_sequence
        from fgbaseline.reports.problem.settings import RunSettings, import_estimators
    settings = RunSettings(sequence=recording, estimators=estimators)
    with watch("reading"):
        sequence = read_sequence(settings)
    with watch(POSING), background_map(lambda _: build_problem(sequence, settings, cores()), 1, cores()) as posed:
        from fgbaseline.compare.estimate_comparison import compare_all
        from fgbaseline.data.estimators.runner import solve_all
        from fgbaseline.reports import figures
        from fgbaseline.reports.run.folder import write_numbers, write_page

        import_estimators(estimators)
        (problem,) = posed()
    answers = solve_all(problem, estimators, lambda name: watch(f"{SOLVING}{name}"))
    with watch("comparison"):
        run = compare_all(problem, answers, settings.record(), processes=cores())
    with TemporaryDirectory(prefix="fgbaseline-") as place:
        folder = Path(place)
        with watch("figures, and tables meanwhile"), figures.drawn_in_background(run, cores()) as finished:
            summary = write_numbers(run, folder)
            drawn = finished()
            (folder / "figures").mkdir()
            figures.save(drawn, folder / "figures")
        with watch("page"):
            write_page(run, summary, folder, drawn)
    return taken


def measured(recording: Path, runs: int, estimators: str) -> list[dict[str, float]]:
    """The stages of so many runs, one after another, each in a process of its own."""
    root = Path(__file__).resolve().parents[1]
    command = [sys.executable, "-m", "benchmarks.run_overhead", str(recording.resolve()), "--estimators", estimators]
    outputs = [
        subprocess.run([*command, "--stages"], stdout=subprocess.PIPE, text=True, check=True, cwd=root).stdout
        for _ in range(runs)
    ]
    return [json.loads(text) for text in outputs]


def rest(taken: Mapping[str, float]) -> float:
    """Seconds of all that is not an estimator."""
    return sum(seconds for stage, seconds in taken.items() if not stage.startswith(SOLVING))


def rows(recording: Path, runs: int, estimators: str = ",".join(DEFAULT_ESTIMATORS)) -> list[Row]:
    """Requirement on the part that is not an estimator, and the share of each stage in the whole."""
    every = measured(recording, runs, estimators)
    whole = statistics.median(sum(taken.values()) for taken in every)
    rests = [rest(taken) for taken in every]
    claim = f"`run {recording.name}` beside its estimators"
    shown = [Row(claim, f"under {WANTED:g} s", *_seconds(rests, whole), statistics.median(rests) < WANTED)]
    seconds = [rest(taken) - taken[POSING] for taken in every]
    shown.append(Row("of that, all but the diagnosis", "", *_seconds(seconds, whole), None))
    for stage in every[0]:
        shown.append(Row(stage, "", *_seconds([taken[stage] for taken in every], whole), None))
    return shown


def _seconds(values: list[float], whole: float) -> tuple[str, str]:
    """Median with its share of the whole, and from the smallest to the largest."""
    median = statistics.median(values)
    return f"{median:.2f} s ({median / whole:.0%})", f"{min(values):.2f} to {max(values):.2f} s"


@click.command()
@click.argument("recording", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--runs", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--estimators", default=",".join(DEFAULT_ESTIMATORS), show_default=True, help="Names, by commas.")
@click.option("--stages", "one", is_flag=True, help="The seconds of one run in this process, as JSON.")
def main(recording: Path, runs: int, estimators: str, one: bool) -> None:
    """Time the stages of `fgbaseline run RECORDING`."""
    if one:
        click.echo(json.dumps(stages(recording, tuple(estimators.split(",")))))
        return
    click.echo(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
    click.echo(table(rows(recording, runs, estimators)))


if __name__ == "__main__":
    main()
