"""Diagnosis of a recording on the terminal, as JSON, as a folder of evidence and as a file of repairs."""

import json
from pathlib import Path
from typing import Any

import click
import numpy as np

from fgbaseline.data import Sequence
from fgbaseline.data.finding import Finding
from fgbaseline.data.formats.atomic_folder import atomic_folder, require_free
from fgbaseline.data.formats.atomic_write import atomic_write
from fgbaseline.data.plural import plural
from fgbaseline.diagnosis import (
    Diagnosis,
    diagnose,
    diagnose_inertial,
    findings_of,
    inertial_findings,
    inertial_sentences,
    inertial_to_json,
    not_identifiable,
    repairs_text,
    to_json,
    track_statistics,
)
from fgbaseline.geometry import InputError

MARK = "diagnosis.json"
"""the file by which a diagnosis's folder is known"""
CLEAN, FINDINGS, CANNOT_TELL = 0, 1, 2
UNWRAPPED = 120
"""columns of the table where no terminal says how many there are"""


def print_diagnosis(
    sequence: Sequence,
    out: Path | None,
    *,
    as_json: bool,
    repairs: Path | None,
    force: bool,
) -> int:
    """Diagnoses a recording, writes and prints the findings; gives the exit code."""
    if force and out is None and repairs is None:
        raise InputError("force: there is nothing to replace; add --out DIR or --write-repairs FILE")
    if out is not None:
        require_free(out, force=force, mark=MARK)
    if repairs is not None:
        _require_writable(repairs, force=force)
    if sequence.imu is not None:
        return _print_inertial(sequence, out, as_json=as_json, repairs=repairs, force=force)
    diagnosis = diagnose(sequence)
    tracks = track_statistics(diagnosis)
    findings = findings_of(diagnosis, tracks)
    text = _text(to_json(diagnosis, tracks, findings))
    if out is not None:
        from fgbaseline.reports import figures

        with atomic_folder(out, force=force, mark=MARK) as folder:
            (folder / "figures").mkdir()
            figures.save(figures.draw_diagnosis(diagnosis, tracks), folder / "figures")
            (folder / MARK).write_text(text, encoding="utf-8")
    if repairs is not None:
        with atomic_write(repairs) as file:
            file.write(repairs_text(diagnosis).encode())
    if as_json:
        click.echo(text, nl=False)
    else:
        _print(diagnosis, findings)
        if out is not None:
            click.echo(f"\nThe evidence is in {out}")
        if repairs is not None:
            click.echo(f"\nThe repairs are in {repairs}; edit them for `fgbaseline run --repairs`")
    if diagnosis.cannot_tell:
        return CANNOT_TELL
    return FINDINGS if findings else CLEAN


def _print_inertial(sequence: Sequence, out: Path | None, *, as_json: bool, repairs: Path | None, force: bool) -> int:
    """The same of a recording with raw inertial samples, which has no repairs to write."""
    if repairs is not None:
        raise InputError("write-repairs: a recording with raw inertial samples has no repairs that can be set")
    found = diagnose_inertial(sequence)
    findings = inertial_findings(found)
    text = _text(inertial_to_json(found, findings))
    if out is not None:
        with atomic_folder(out, force=force, mark=MARK) as folder:
            (folder / MARK).write_text(text, encoding="utf-8")
    if as_json:
        click.echo(text, nl=False)
    else:
        o = found.sequence.observations
        click.echo(
            f"{sequence.name}: {plural(sequence.n_frames, 'frame')}, {plural(len(o), 'observation')} of "
            f"{plural(len(np.unique(o.landmark)), 'track')}, {plural(len(sequence.imu or ()), 'inertial sample')}"
        )
        for remark in sequence.remarks:
            click.echo(remark)
        if found.cannot_tell:
            click.echo(f"Nothing can be found out about its motion: {found.cannot_tell}.")
        if findings:
            _print_findings(findings)
        elif not found.cannot_tell:
            click.echo("Nothing wrong was found.")
        for sentence in inertial_sentences(found):
            click.echo(sentence)
        if out is not None:
            click.echo(f"\nThe evidence is in {out}")
    if found.cannot_tell:
        return CANNOT_TELL
    return FINDINGS if findings else CLEAN


def _require_writable(file: Path, *, force: bool) -> None:
    if file.exists() and not force:
        raise InputError(f"{file}: the file exists; choose another, or replace it with --force")
    if file.exists() and not file.is_file():
        raise InputError(f"{file}: this is no file; give the name of one")
    if not file.parent.is_dir():
        raise InputError(f"{file}: there is no folder {file.parent}; make it, or choose another place")


def _text(report: dict[str, Any]) -> str:
    """Text of the file, to the byte the same for the same diagnosis."""
    return json.dumps(report, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def _print(diagnosis: Diagnosis, findings: tuple[Finding, ...]) -> None:
    sequence = diagnosis.sequence
    click.echo(
        f"{sequence.name}: {plural(sequence.n_frames, 'frame')}, {plural(len(sequence.observations), 'observation')} "
        f"of {plural(len(np.unique(sequence.observations.landmark)), 'track')}"
    )
    if diagnosis.cannot_tell:
        click.echo(f"Nothing can be found out about its velocities: {diagnosis.cannot_tell}.")
    if findings:
        _print_findings(findings)
    elif not diagnosis.cannot_tell:
        click.echo("Nothing wrong was found.")
    unknown = () if diagnosis.cannot_tell else not_identifiable(diagnosis)
    if unknown:
        click.echo("\nNot identifiable in this recording:")
        for sentence in unknown:
            click.echo(f"- {sentence}")
    if diagnosis.fit is not None:
        click.echo(f"\n{_noise(diagnosis)}")


def _noise(diagnosis: Diagnosis) -> str:
    """Sentence on the noise."""
    fit = diagnosis.fit
    assert fit is not None
    sigma = fit.sigmas
    sentence = (
        f"Noise (one sigma): {sigma.linear_velocity:.3f} m/s and {sigma.angular_velocity:.4f} rad/s of a velocity held "
        f"over an interval, {sigma.pixel:.2f} px of a pixel row ({fit.white.pixel:.2f} px from frame to frame"
    )
    if fit.inflation.pixel > 1.0:
        sentence += f", {fit.inflation.pixel:.1f} times that because the errors of tracks last"
    if fit.inflation.velocity > 1.0:
        sentence += (
            f"; velocities {fit.inflation.velocity:.1f} times what single intervals show, because their errors last"
        )
    return sentence + ")."


def _print_findings(findings: tuple[Finding, ...]) -> None:
    from fgbaseline.reports.tables import Cell, Column, Row, Table, print_table

    rows = tuple(
        Row(
            f.code,
            (
                Cell(f.sentence if f.certainty == "counted" else f"{f.sentence} ({f.certainty})"),
                Cell(_number(f.before, f.unit)),
                Cell(_number(f.after, f.unit)),
            ),
        )
        for f in findings
    )
    columns = (Column("what was found", words=True), Column("before"), Column("after"))
    print_table(Table(columns, rows, name="finding"), width=UNWRAPPED, spaced=True)


def _number(value: float, unit: str) -> str:
    if unit.startswith("share"):
        return f"{value:.1%}"
    if unit in ("m/s", "rad/s"):
        return f"{value:.3g} {unit}"
    return f"{value:,.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
