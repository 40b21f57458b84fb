"""Place of a page on the terminal, and the page in the browser."""

import webbrowser
from pathlib import Path

import click


def announce(page: Path, kind: str = "report", *, opened: bool = False, printed: bool = True) -> None:
    """Prints where a page is and opens it in the browser, as asked for."""
    if printed:
        click.echo(f"\nThe {kind} is in {page}")
    if opened and not webbrowser.open(page.resolve().as_uri()):
        click.echo("fgbaseline: there is no browser here to open the page in", err=True)
