"""Branches that the tests take, by room: `python -m benchmarks.branch_coverage` reads what `make coverage` measured.

Coverage's own total mixes lines and branches; this holds the branches alone to the share they should have.
"""

import json
import sys
from collections import Counter
from pathlib import Path

import click

from .packages import ROOMS, TOP

MEASURED = Path("out/coverage/coverage.json")


@click.command()
@click.option("--at-least", default=92.0, show_default=True, help="per cent of all branches; fewer: exit code 1")
def main(at_least: float) -> None:
    """Print the table, and fail where too few branches are taken."""
    counts: dict[str, Counter[str]] = {room: Counter() for room in (TOP, *ROOMS, "all")}
    for name, file in json.loads(MEASURED.read_text(encoding="utf-8"))["files"].items():
        of_file = {what: count for what, count in file["summary"].items() if isinstance(count, int)}
        for room in (Path(name).parts[0], "all"):
            counts[room].update(of_file)
    click.echo("| room | lines | run | branches | taken |\n|---|---|---|---|---|")
    for room, of in counts.items():
        lines, branches = of["num_statements"], of["num_branches"]
        run, taken = _percent(of["covered_lines"], lines), _percent(of["covered_branches"], branches)
        click.echo(f"| {room} | {lines:,} | {run:.1f} % | {branches:,} | {taken:.1f} % |")
    if taken < at_least:
        click.echo(f"{taken:.2f} % of the branches are taken, fewer than {at_least} %", err=True)
        sys.exit(1)


def _percent(part: int, whole: int) -> float:
    return 100.0 * part / whole if whole else 100.0


if __name__ == "__main__":
    main()
