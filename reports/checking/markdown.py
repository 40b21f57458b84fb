"""A check as Markdown for a pull request."""

from fgbaseline.compare.limits import Outcome

from ..formatting import md as escaped
from .line import Checked
from .wording import WORDS, cells, columns, remarks, verdict

SIGN = {Outcome.HOLDS: "✅", Outcome.CANNOT_TELL: "❔", Outcome.FALLS_SHORT: "❌"}


def markdown(checked: Checked) -> str:
    """A heading with how it went, what is to be said of the reference, the table, and why."""
    titles = columns(checked)
    rows = []
    for line in checked.lines:
        texts = cells(line) | {"limit": f"{SIGN[line.outcome]} {line.outcome.value}"}
        rows.append(f"| {' | '.join(escaped(texts[title]) for title in titles)} |")
    return "\n".join(
        [
            f"### Accuracy: {escaped(verdict(checked))}",
            "",
            *(f"> {escaped(sentence)}\n" for sentence in [*checked.shortages, *checked.references]),
            f"| {' | '.join(titles)} |",
            f"|{'|'.join(' :-- ' if title in WORDS else ' --: ' for title in titles)}|",
            *rows,
            "",
            *(f"- {escaped(sentence)}" for sentence in remarks(checked)),
            f"Limits: {escaped(checked.limits)}"
            + (f"; baseline: {escaped(checked.baseline)}" if checked.baseline else ""),
            "",
        ]
    )
