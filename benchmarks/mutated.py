"""Mutated recordings and trajectories through `run`, `diagnose`, `compare` and `check`: what ends how.

    python -m benchmarks.mutated --cases 10000 --workers 2

Case i is the same in every run: base, mutation (tests/builders/mutations.py, in turn) and the mutation's chance come
from i.
Each command runs in a fork of a worker, may take a minute of a processor, and ends with 0, 1 or 2 and no traceback.
A recording in wrong units passes neither `diagnose` nor `check`. A mutated trajectory is refused, compared with the
good one's errors, or reported to be in doubt.
The exit code is 1 where a case violates that.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import click
from rich.console import Console
from rich.table import Table

from tests.builders.mutated_files import Ended, case


def cases(first: int, n: int, workers: int, drawing: bool) -> Iterator[tuple[int, Ended]]:
    """Cases `first` to `first + n - 1`, in order, as they end."""
    numbers = range(first, first + n)
    if workers == 1:
        yield from ((number, case(number, drawing=drawing)) for number in numbers)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from zip(numbers, pool.map(partial(case, drawing=drawing), numbers), strict=True)


@click.command()
@click.option("--cases", "n", default=400, show_default=True, help="How many.")
@click.option("--first", default=0, show_default=True, help="Number of the first one: a case alone is --cases 1.")
@click.option("--workers", default=2, show_default=True)
@click.option("--figures", is_flag=True, help="Draw them: nine tenths of a run's time.")
def main(n: int, first: int, workers: int, figures: bool) -> None:
    """Run mutated recordings and trajectories through the commands, and count."""
    counts: dict[tuple[str, str], Counter[str]] = {}
    violated = repaired = 0
    for number, ended in cases(first, n, workers, figures):
        kind = ("recording", "trajectory")[number % 2]
        for verb, code in ended.codes.items():
            counts.setdefault((f"{kind}: {ended.mutation}", verb), Counter())[str(code)] += 1
        repaired += ended.repaired
        violated += bool(ended.violations)
        for violation in ended.violations:
            click.echo(f"case {number}, {kind}, {ended.mutation}: {violation}", err=True)
    table = Table("mutation", "command", "0", "1", "2", "other", box=None)
    for (name, verb), codes in sorted(counts.items()):
        other = sum(codes.values()) - sum(codes[code] for code in "012")
        table.add_row(name, verb, *(str(codes[code]) for code in "012"), str(other))
    Console(width=120).print(table)
    click.echo(f"{n} cases: {violated} with a violation, {repaired} trajectories have the errors of the good file")
    sys.exit(int(violated > 0))


if __name__ == "__main__":
    main()
