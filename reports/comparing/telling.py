"""What a person sees of a comparison: the verdict, the table, and where the report is."""

from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

from fgbaseline.geometry import InputError

from ..whole_folder import require_free
from .comparison import Comparison
from .computing import compare_entries
from .entries import read_entries
from .settings import MARK, Settings
from .tables import text_table

UNWRAPPED = 160
"""columns of the table where no terminal says how many there are"""


def tell(
    reference: str,
    estimates: Sequence[str],
    landmarks: Sequence[str],
    settings: Settings,
    out: Path | None,
    *,
    force: bool,
) -> int:
    """Compares, says what was found and writes the folder if there is to be one; gives the exit code."""
    if out is None and force:
        raise InputError("force: there is no folder to replace; add --out DIR")
    if out is not None:
        require_free(out, force=force, mark=MARK)
    with np.errstate(all="ignore"):
        comparison = compare_entries(read_entries(reference, estimates, landmarks, settings), settings)
    if out is not None:
        comparison.write(out, force=force)
    trust, *others = comparison.verdict
    click.echo(f"{trust}\n")
    _print(comparison)
    click.echo(f"{comparison.caption}\n")
    for sentence in others:
        click.echo(sentence)
    if out is not None:
        click.echo(f"\nThe report is in {out / 'report.html'}")
    return 0


def _print(comparison: Comparison) -> None:
    """The table, a line for each figure and a column for each estimate: so it fits however many figures there are."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    names, lines = text_table(comparison)
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("", no_wrap=True)
    for name in names:
        table.add_column(Text(name), justify="right")
    for line in lines:
        table.add_row(Text(line.title), *map(Text, line.cells))
    console = Console()
    Console(width=None if console.is_terminal else max(console.width, UNWRAPPED), highlight=False).print(table)
