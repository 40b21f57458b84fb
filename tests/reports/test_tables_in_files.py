"""Tables of a run in files: what the page shows beside a cell stands there too, under the same words."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

from fgbaseline.reports.run.folder import write_numbers
from fgbaseline.reports.tables.run_details import trust_table
from fgbaseline.reports.tables.table import Cell, Column, Row, Table
from fgbaseline.reports.tables.writers import latex, markdown

from ..builders.runs import standard_run


def test_notes_of_cells_are_in_the_files() -> None:
    rows = (Row("ekf", (Cell("overconfident", note="a"),)), Row("isam2", (Cell("20.1", best=True, note="b"),)))
    notes = (("a", "P is below P_ref"), ("b", "over 54 of 1,009 frames"))
    table = Table((Column("NEES"),), rows, caption="Best of a column in bold.", notes=notes).transposed()
    text = markdown(table)
    assert "overconfident <sup>a</sup>" in text
    assert "**20.1** <sup>b</sup>" in text
    assert text.endswith("- <sup>a</sup> P is below P\\_ref.\n- <sup>b</sup> over 54 of 1,009 frames.\n")
    text = latex(table)
    assert r"overconfident\textsuperscript{a} & \textbf{20.1}\textsuperscript{b}" in text
    assert text.index(r"\end{tabular}") < text.index(r"\textsuperscript{b} over 54 of 1,009 frames.")
    assert text.index(r"over 54") < text.index(r"\end{table}")


def test_the_marks_of_notes_are_in_the_order_of_reading() -> None:
    rows = (Row("ekf", (Cell("1.0"), Cell("–", note="a"))), Row("isam2", (Cell("–", note="b"), Cell("2.0"))))
    table = Table((Column("NEES"), Column("NIS")), rows, notes=(("a", "no innovations"), ("b", "the reference")))
    turned = table.transposed()
    assert [cell.note for row in turned.rows for cell in row.cells] == ["", "a", "b", ""]
    assert turned.notes == (("a", "the reference"), ("b", "no innovations"))
    assert turned.transposed() == replace(table, columns=turned.transposed().columns, name="")


def test_captions_and_limits_of_the_files_are_those_of_what_they_show(tmp_path: Path) -> None:
    run = standard_run()
    write_numbers(run, tmp_path)
    for name in ("table.md", "table.tex"):
        text = (tmp_path / name).read_text("utf-8")
        assert "Best of a row in bold" in text
        assert f"Estimators on {run.problem.sequence.name}" in text
        assert "the reference is isam2." in text
    written = pd.read_csv(tmp_path / "tables" / "trust.csv")
    headings = [column.heading for column in trust_table(run.trust.criteria).columns]
    assert headings[1:3] == ["trusted if", "doubtful if"]
    assert written["trusted_limit"].tolist() == [float(f"{c.doubtful:.6g}") for c in run.trust.criteria]
    assert written["doubtful_limit"].tolist() == [float(f"{c.untrusted:.6g}") for c in run.trust.criteria]
