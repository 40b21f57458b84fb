"""Sentences on the terminal, place of a page there, and the page in the browser."""

import shutil
import sys
import textwrap
import webbrowser
from collections.abc import Sequence
from pathlib import Path

import click

from .formatting import NO_BREAK, unbroken

LONGEST_LINE = 100
"""columns of a line that is read with ease, on a wider terminal too"""


def print_sentences(sentences: Sequence[str], most: int | None = None, mark: str = "- ") -> None:
    """Prints the first `most` sentences, wrapped between words on a terminal, and how many more the report has.

    Line breaks separate no value from its unit and break no interval.
    """
    for sentence in sentences[:most]:
        click.echo(_wrapped(sentence, mark) if sys.stdout.isatty() else f"{mark}{sentence}")
    if more := len(sentences[most:]) if most is not None else 0:
        click.echo(f"The report has {more} more {'conclusion' if more == 1 else 'conclusions'}.")


def _wrapped(text: str, mark: str) -> str:
    width = min(LONGEST_LINE, shutil.get_terminal_size().columns)
    lines = textwrap.fill(
        unbroken(text),
        width,
        initial_indent=mark,
        subsequent_indent=" " * len(mark),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return lines.replace(NO_BREAK, " ")


def announce(page: Path, kind: str = "report", *, opened: bool = False, printed: bool = True) -> None:
    """Prints where a page is and opens it in the browser, as asked for."""
    if printed:
        click.echo(f"\nThe {kind} is in {page}")
    if opened and not webbrowser.open(page.resolve().as_uri()):
        click.echo("fgbaseline: there is no browser here to open the page in", err=True)
