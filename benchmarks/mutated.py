"""Mutated recordings and trajectories through `run`, `diagnose`, `compare` and `check`: what ends how.

    python -m benchmarks.mutated --cases 10000 --workers 2

Case i is the same in every run: base, mutation (tests/builders/mutations.py, in turn) and the mutation's chance come
from i.
Each command runs in a fork of a worker, may take a minute of a processor, and ends with 0, 1 or 2 and no traceback.
A recording in wrong units passes neither `diagnose` nor `check`. A mutated trajectory is refused, compared with the
good one's errors, or reported to be in doubt.
Without `--full`, recordings are short, a tenth of the runs has isam2 beside dead reckoning, and there are no figures.
The exit code is 1 where a case violates that.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import click
from rich.console import Console
from rich.table import Table

from tests.builders.mutated_files import FAST, FULL, Ended, Form, case

EVERY = 100
"""cases after which progress is printed"""


@dataclass
class Outcome:
    """Counts for one mutation and command."""

    codes: Counter[int | None] = field(default_factory=Counter)
    violations: int = 0
    longest: float = 0.0
    """s of a processor"""


def cases(numbers: range, workers: int, form: Form, drawing: bool) -> Iterator[tuple[int, Ended]]:
    """Runs the numbered cases and yields their ends in order."""
    if workers == 1:
        yield from ((number, case(number, form, drawing=drawing)) for number in numbers)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from zip(numbers, pool.map(partial(case, form=form, drawing=drawing), numbers), strict=True)


@click.command()
@click.option("--cases", "n", default=400, show_default=True, help="How many.")
@click.option("--first", default=0, show_default=True, help="Number of the first one: a case alone is --cases 1.")
@click.option("--workers", default=2, show_default=True)
@click.option("--full", is_flag=True, help="Recordings of 120 frames, isam2 in every run; figures have files.")
@click.option("--figures", is_flag=True, help="Draw the figures of --full: nine tenths of a run's time.")
def main(n: int, first: int, workers: int, full: bool, figures: bool) -> None:
    """Run mutated recordings and trajectories through the commands, and count."""
    outcomes: dict[tuple[str, str], Outcome] = {}
    violated = repaired = 0
    for number, ended in cases(range(first, first + n), workers, FULL if full else FAST, figures):
        kind = ("recording", "trajectory")[number % 2]
        for verb, code in ended.codes.items():
            outcome = outcomes.setdefault((f"{kind}: {ended.mutation}", verb), Outcome())
            outcome.codes[code] += 1
            outcome.violations += any(violation.startswith(verb) for violation in ended.violations)
            outcome.longest = max(outcome.longest, ended.seconds[verb])
        repaired += ended.repaired
        violated += bool(ended.violations)
        for violation in ended.violations:
            click.echo(f"case {number}, {kind}, {ended.mutation}: {violation}", err=True)
        if (number - first + 1) % EVERY == 0:
            click.echo(f"{number - first + 1} cases: {violated} with a violation", err=True)
    Console(width=120).print(_table(outcomes))
    click.echo(f"{n} cases: {violated} with a violation, {repaired} trajectories have the errors of the good file")
    sys.exit(int(violated > 0))


def _table(outcomes: dict[tuple[str, str], Outcome]) -> Table:
    table = Table("mutation", "command", "0", "1", "2", "other", "violations", "longest, s", box=None)
    for (name, verb), outcome in sorted(outcomes.items()):
        codes = [outcome.codes[code] for code in (0, 1, 2)]
        other = outcome.codes.total() - sum(codes)
        table.add_row(name, verb, *map(str, [*codes, other, outcome.violations]), f"{outcome.longest:.1f}")
    return table


if __name__ == "__main__":
    main()
