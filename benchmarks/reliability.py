"""Every estimator on recordings that none was made for, `python -m benchmarks.reliability`: writes docs/reliability.md.

The recordings, and what is promised of each cell, are those of tests/estimators/test_hostile_recordings.py.
"""

# ruff: noqa: E402

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import time
from pathlib import Path

import click

from fgbaseline.compare.estimate_comparison import Result, Run
from tests.builders.hostile import ESTIMATORS, RECORDINGS, REFUSED, Cell, Hostile, cell, error, sigmas, solved

from . import docs_table

PLACE = Path("docs/reliability.md")


def outcome(result: Result) -> str:
    """A cell of the table."""
    kind = cell(result)
    if kind is Cell.FAILED:
        return f"failed: {result.estimate.reason}"
    off = sigmas(result)
    meters = f"{error(result):.2g}" if error(result) < 100 else f"{error(result):.0f}"
    figures = f"{meters} m, {off:.1f} σ" if off < 100 else f"{meters} m, {off:.0f} σ"
    return f"**{figures}**" if kind is Cell.OVERCONFIDENT else figures


def row(recording: Hostile, run: Run) -> str:
    """A line of the table."""
    cells = [recording.name, *(outcome(run.results[name]) for name in ESTIMATORS), run.trust.verdict.name.lower()]
    return f"| {' | '.join(cells)} |"


@click.command()
def main() -> None:
    """Solve every recording and write the table."""
    lines = [f"| recording | {' | '.join(ESTIMATORS)} | reference |", "|" + "---|" * (len(ESTIMATORS) + 2)]
    for recording in RECORDINGS:
        start = time.monotonic()
        lines.append(row(recording, solved(recording)))
        click.echo(f"{recording.name}: {time.monotonic() - start:.0f} s", err=True)
    lines += [f"| {name} | {' | '.join(['refused'] * len(ESTIMATORS))} | |" for name in REFUSED]
    notes = [f"- **{recording.name}**: {recording.note}." for recording in RECORDINGS if recording.note]
    docs_table.write(PLACE, "reliability", [*lines, "", *notes])


if __name__ == "__main__":
    main()
