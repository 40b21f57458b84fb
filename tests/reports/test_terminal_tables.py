"""Tables on terminals: no word, no figure and no interval is broken, however narrow the terminal."""

import re
import sys
from io import StringIO
from typing import Any

import pytest
import rich.console

from fgbaseline.reports.open_page import print_sentences
from fgbaseline.reports.tables.table import Cell, Column, Row, Table
from fgbaseline.reports.tables.writers import print_table

HEADINGS = ("ATE RMSE", "divergence RMSE", "median reprojection", "claimed sigma", "reference NEES", "time")
TEXTS = ("0.523 [0.412, 0.663]", "22.8", "1.03", "0.0536", "overconfident", "3.82")
NAMES = ("dead-reckoning", "joint-ekf-first-estimate", "isam2-online")


def printed(monkeypatch: pytest.MonkeyPatch, table: Table, columns: int, **how: Any) -> list[str]:
    """Lines of a table on a terminal of so many columns."""
    terminal = StringIO()
    made = rich.console.Console
    monkeypatch.setattr(
        "rich.console.Console",
        lambda **settings: made(**settings, file=terminal, force_terminal=True, width=columns, color_system=None),
    )
    print_table(table, **how)
    return [re.sub(r"\x1b\[[0-9;]*m", "", line).rstrip() for line in terminal.getvalue().splitlines()]


def example() -> Table:
    rows = tuple(Row(name, (Cell("ok"), *map(Cell, TEXTS))) for name in NAMES)
    failed = Row("mine", (), reason="its function raised ValueError: no tracks", status="failed")
    return Table((Column("status", words=True), *(Column(h, unit="m") for h in HEADINGS)), (*rows, failed))


@pytest.mark.parametrize("columns", [50, 80, 120, 200])
def test_every_word_and_figure_is_whole(monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    lines = printed(monkeypatch, example(), columns)
    assert max(map(len, lines)) <= columns
    text = "\n".join(lines)
    for figure in TEXTS:
        assert text.count(figure) == len(NAMES)
    for word in {word for heading in HEADINGS for word in heading.split()}:
        assert re.search(rf"(?<![\w-]){word}(?![\w-])", text)
    blocks = [block for block in text.split("\n\n") if "dead-reckoning" in block]
    for block in blocks:
        assert all(name in block for name in NAMES)
    assert (len(blocks) == 1) == (columns >= 120)
    assert "mine: its function raised ValueError: no tracks" in " ".join(text.split())


def test_sentences_wrap_between_words(monkeypatch: pytest.MonkeyPatch) -> None:
    sentence = "Components w_y and w_z are recorded with the opposite sign, and the gyroscope has a bias at rest."
    table = Table((Column("before"), Column("after")), (Row(sentence, (Cell("0.08 rad/s"), Cell("0.02 rad/s"))),))
    lines = printed(monkeypatch, table, 60, spaced=True)
    assert max(map(len, lines)) <= 60
    names = " ".join(line[:36] for line in lines)
    assert set(sentence.split()) <= set(names.replace("0.08", "").split())
    assert any("0.08 rad/s" in line and "0.02 rad/s" in line for line in lines)


@pytest.mark.parametrize("columns", [50, 80, 120])
def test_sentences_on_a_terminal_are_a_short_list_whose_lines_break_between_words(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], columns: int
) -> None:
    each = ", ".join(f"joint-ekf-{i} {i + 0.5} × 10⁻⁴ m [{i}.25, {i}.75] (0.286 % of it)" for i in range(8))
    sentences = [f"Sentence {i}: {each}." for i in range(9)]
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    print_sentences(sentences, 6)
    *shown, more = capsys.readouterr().out.splitlines()
    assert max(map(len, shown)) <= min(columns, 100)
    assert [line for line in shown if line.startswith("- ")] == [line for line in shown if "Sentence" in line]
    for figure in ("0.286 %", *(f"{i + 0.5} × 10⁻⁴ m" for i in range(8)), *(f"[{i}.25, {i}.75]" for i in range(8))):
        assert "\n".join(shown).count(figure) == "".join(sentences[:6]).count(figure)
    assert " ".join(" ".join(shown).split()) == " ".join(f"- {sentence}" for sentence in sentences[:6])
    assert more == "The report has 3 more conclusions."


def test_sentences_in_a_file_have_one_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    long = "A sentence with " + "many " * 60 + "words."
    print_sentences([long, "And a short one."])
    assert capsys.readouterr().out == f"- {long}\n- And a short one.\n"
