"""A check as a table on the terminal."""

from rich.console import Console
from rich.table import Table

from fgbaseline.compare.limits import Outcome

from .line import Checked
from .wording import WORDS, cells, columns, remarks, verdict

STYLE = {Outcome.HOLDS: "green", Outcome.CANNOT_TELL: "yellow", Outcome.FALLS_SHORT: "bold red"}
UNWRAPPED = 160
"""columns of the table where no terminal says how many there are"""


def print_check(checked: Checked) -> None:
    """Prints what is too little and what is said of the reference, the table, the reasons, and how it went."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    titles = columns(checked)
    for title in titles:
        table.add_column(title, justify="left" if title in WORDS else "right", overflow="fold")
    for line in checked.lines:
        texts = cells(line)
        table.add_row(*(texts[title] for title in titles), style=STYLE[line.outcome])
    console = Console()
    console = Console(width=None if console.is_terminal else max(console.width, UNWRAPPED), highlight=False)
    for sentence in [*checked.shortages, *checked.references]:
        console.print(sentence, markup=False, soft_wrap=True)
    console.print(table, markup=False)
    for sentence in [*remarks(checked), verdict(checked)]:
        console.print(sentence, markup=False, soft_wrap=True)
