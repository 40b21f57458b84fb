"""`fgbaseline diagnose`: findings on the terminal, as JSON, as a folder with figures and as a file of repairs."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np

from fgbaseline.data import Sequence
from fgbaseline.data.finding import Finding
from fgbaseline.data.formats.atomic_folder import atomic_folder, require_free
from fgbaseline.data.formats.atomic_write import atomic_write, require_new
from fgbaseline.data.plural import plural
from fgbaseline.diagnosis import (
    Diagnosis,
    TrackStatistics,
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
"""the file that marks a diagnosis's folder"""
CLEAN, FINDINGS, UNDECIDED = 0, 1, 2
"""exit codes"""
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
    """Diagnoses a recording, writes and prints the findings, and returns the exit code."""
    if force and out is None and repairs is None:
        raise InputError("force: there is nothing to replace; add --out DIR or --write-repairs FILE")
    if out is not None:
        require_free(out, force=force, mark=MARK)
    if repairs is not None:
        _require_writable(repairs, force=force)
        if sequence.imu is not None:
            raise InputError("write-repairs: a recording with raw inertial samples has no repairs that can be set")
    report = _diagnosed(sequence) if sequence.imu is None else _diagnosed_inertial(sequence)
    text = json.dumps(report.contents, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    if out is not None:
        with atomic_folder(out, force=force, mark=MARK) as folder:
            if report.evidence is not None:
                from fgbaseline.reports import figures

                (folder / "figures").mkdir()
                figures.save(figures.draw_diagnosis(*report.evidence), folder / "figures")
            (folder / MARK).write_text(text, encoding="utf-8")
    if repairs is not None and report.evidence is not None:
        with atomic_write(repairs, force=force) as file:
            file.write(repairs_text(report.evidence[0]).encode())
    if as_json:
        click.echo(text, nl=False)
    else:
        _print(report)
        if out is not None:
            click.echo(f"\nThe diagnosis is in {out}")
        if repairs is not None:
            click.echo(f"\nThe repairs are in {repairs}; edit them for `fgbaseline run --repairs`")
    if report.cannot_tell:
        return UNDECIDED
    return FINDINGS if report.findings else CLEAN


class _Report(NamedTuple):
    """Diagnosis in the form that is printed and written."""

    recording: str
    """name and size, one or more lines"""
    measured: str
    """what the motion is measured by"""
    contents: dict[str, Any]
    """of diagnosis.json"""
    findings: tuple[Finding, ...]
    cannot_tell: str
    """reason of an incomplete diagnosis, without its full stop; empty otherwise"""
    sentences: tuple[str, ...]
    """results that are no faults"""
    evidence: tuple[Diagnosis, TrackStatistics] | None = None
    """what figures and repairs are made from; raw inertial samples have neither"""


def _diagnosed(sequence: Sequence) -> _Report:
    diagnosis = diagnose(sequence)
    tracks = track_statistics(diagnosis)
    findings = findings_of(diagnosis, tracks)
    unknown = () if diagnosis.cannot_tell else not_identifiable(diagnosis)
    sentences = ["\nNot identifiable in this recording:", *(f"- {sentence}" for sentence in unknown)] if unknown else []
    if diagnosis.fit is not None:
        sentences.append(f"\n{_noise(diagnosis)}")
    return _Report(
        _size(diagnosis.sequence),
        "velocities",
        to_json(diagnosis, tracks, findings),
        findings,
        diagnosis.cannot_tell,
        tuple(sentences),
        (diagnosis, tracks),
    )


def _diagnosed_inertial(sequence: Sequence) -> _Report:
    found = diagnose_inertial(sequence)
    findings = inertial_findings(found)
    samples = plural(len(sequence.imu or ()), "inertial sample")
    return _Report(
        "\n".join([f"{_size(found.sequence)}, {samples}", *sequence.remarks]),
        "inertial samples",
        inertial_to_json(found, findings),
        findings,
        found.cannot_tell,
        inertial_sentences(found),
    )


def _size(sequence: Sequence) -> str:
    o = sequence.observations
    return (
        f"{sequence.name}: {plural(sequence.n_frames, 'frame')}, {plural(len(o), 'observation')} of "
        f"{plural(len(np.unique(o.landmark)), 'track')}"
    )


def _require_writable(file: Path, *, force: bool) -> None:
    require_new(file, force=force)
    if file.exists() and not file.is_file():
        raise InputError(f"{file}: this is not a file; give the name of one")
    if not file.parent.is_dir():
        raise InputError(f"{file}: there is no folder {file.parent}; create it, or choose another folder")


def _print(report: _Report) -> None:
    click.echo(report.recording)
    if report.cannot_tell:
        click.echo(f"The {report.measured} cannot be diagnosed: {report.cannot_tell}.")
    if report.findings:
        _print_findings(report.findings)
    elif not report.cannot_tell:
        click.echo("No fault detected.")
    for sentence in report.sentences:
        click.echo(sentence)


def _noise(diagnosis: Diagnosis) -> str:
    """Sentences on the estimated noise and its inflation."""
    fit = diagnosis.fit
    assert fit is not None
    sigma, white = fit.sigmas, fit.white
    text = (
        f"Noise (1-sigma): {sigma.linear_velocity:.3f} m/s and {sigma.angular_velocity:.4f} rad/s of a velocity over "
        f"its interval, {sigma.pixel:.2f} px of a pixel row."
    )
    if fit.inflation.pixel > 1.0:
        text += (
            f" Pixel sigma: {white.pixel:.2f} px from frame to frame, inflated by {fit.inflation.pixel:.1f} for "
            "time-correlated errors."
        )
    if fit.inflation.velocity > 1.0:
        text += f" Velocity sigma: inflated by {fit.inflation.velocity:.1f} for time-correlated errors."
    return text


def _print_findings(findings: tuple[Finding, ...]) -> None:
    from ..formatting import NO_BREAK, quantity
    from ..tables import Cell, Column, Row, Table, print_table

    def row(finding: Finding) -> Row:
        certainty = "" if finding.certainty == "counted" else f" ({finding.certainty})"
        figures = (quantity(x, finding.unit).replace(NO_BREAK, " ") for x in (finding.before, finding.after))
        return Row(finding.code, tuple(map(Cell, (f"{finding.sentence}{certainty}", *figures))))

    columns = (Column("description", words=True), Column("before"), Column("after"))
    print_table(Table(columns, tuple(map(row, findings)), name="finding"), width=UNWRAPPED, spaced=True)
