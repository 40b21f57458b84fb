"""`fgbaseline diagnose`: findings on the terminal, as JSON, as a folder with figures and page, as a file of repairs."""

import json
from pathlib import Path

import click

from fgbaseline.data import Sequence
from fgbaseline.data.formats.files.atomic_folder import atomic_folder, require_free
from fgbaseline.data.formats.files.atomic_write import atomic_write, require_new
from fgbaseline.diagnosis import diagnose, repairs_text
from fgbaseline.geometry import InputError

from ..open_page import announce, print_sentences
from ..results.diagnosis import Found, found_by, found_of_inertial

MARK = "diagnosis.json"
"""the file that marks a diagnosis's folder"""
CLEAN, FINDINGS, UNDECIDED = 0, 1, 2
"""exit codes"""
UNWRAPPED = 120
"""columns of the table where no terminal says how many there are"""


def print_diagnosis(
    sequence: Sequence, out: Path | None, *, as_json: bool, repairs: Path | None, force: bool, opened: bool = False
) -> int:
    """Diagnoses a recording, writes and prints the findings, and returns the exit code."""
    if force and out is None and repairs is None:
        raise InputError("force: there is nothing to replace; add --out DIR or --write-repairs FILE")
    if opened and out is None:
        raise InputError("open: there is no page; add --out DIR")
    if out is not None:
        require_free(out, force=force, mark=MARK)
    if repairs is not None:
        _require_writable(repairs, force=force)
        if sequence.imu is not None:
            raise InputError("write-repairs: a recording with raw inertial samples has no repairs that can be set")
    if sequence.imu is None:
        diagnosis = diagnose(sequence)
        found = found_by(diagnosis)
        if repairs is not None:
            with atomic_write(repairs, force=force) as file:
                file.write(repairs_text(diagnosis).encode())
    else:
        found = found_of_inertial(sequence)
    text = json.dumps(found.document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    if out is not None:
        _write(found, text, out, force=force)
    if as_json:
        click.echo(text, nl=False)
    else:
        _print(found)
        if repairs is not None:
            click.echo(f"\nThe repairs are in {repairs}; edit them for `fgbaseline run --repairs`")
    if out is not None:
        announce(out / "report.html", "diagnosis", opened=opened, printed=not as_json)
    if found.undecided:
        return UNDECIDED
    return FINDINGS if found.findings else CLEAN


def _write(found: Found, text: str, out: Path, *, force: bool) -> None:
    from fgbaseline.reports import figures

    from ..html.run_page import render_diagnosis

    with atomic_folder(out, force=force, mark=MARK) as folder:
        drawn = {}
        if found.diagnosis is not None and found.tracks is not None:
            drawn = figures.draw_diagnosis(found.diagnosis, found.tracks)
            (folder / "figures").mkdir()
            figures.save(drawn, folder / "figures")
        (folder / "report.html").write_text(render_diagnosis(found, drawn), encoding="utf-8")
        (folder / MARK).write_text(text, encoding="utf-8")


def _require_writable(file: Path, *, force: bool) -> None:
    require_new(file, force=force)
    if file.exists() and not file.is_file():
        raise InputError(f"{file}: this is not a file; give the name of one")
    if not file.parent.is_dir():
        raise InputError(f"{file}: there is no folder {file.parent}; create it, or choose another folder")


def _print(found: Found) -> None:
    click.echo(f"{found.sequence.name}: {found.counts}")
    if found.findings:
        from ..tables.run_details import terminal_findings
        from ..tables.writers import print_table

        print_table(terminal_findings(found.findings), width=UNWRAPPED, spaced=True)
    if found.undecided or not found.findings:
        print_sentences(found.verdict[:1], mark="")
    if found.not_identifiable:
        click.echo("\nNot identifiable in this recording:")
        print_sentences(found.not_identifiable)
    for sentence in found.sentences:
        click.echo()
        print_sentences([sentence], mark="")
