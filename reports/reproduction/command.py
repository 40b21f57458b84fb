"""`fgbaseline reproduce`: recordings, studies, claims, and the folder with figures, tables and page."""

import csv
import json
from collections.abc import Sequence as Several
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click
import numpy as np
from threadpoolctl import threadpool_limits

from fgbaseline.data.formats.atomic_folder import atomic_folder, require_free
from fgbaseline.geometry import InputError

from ..figures import save
from ..figures.reproduction import draw
from ..progress import reporter
from ..tables.writers import print_table
from .claims import Claim, claims_of, missing_claims
from .experiments import Study, SweepSettings, stages_of, study_recording
from .page import claims_table, render
from .recordings import read_subjects

MARK = "claims.json"
"""the file that marks a reproduction's folder"""
UNWRAPPED = 150
"""columns of the table where no terminal says how many there are"""


def reproduce(paths: Several[Path], out: Path, sweep: SweepSettings, *, force: bool) -> int:
    """Studies the recordings, writes the folder and prints the claims; returns 0.

    Raises InputError for an invalid recording, and where the folder exists or cannot be written.
    """
    require_free(out, force=force, mark=MARK)
    _require_distinct(sweep)
    progress = reporter()
    subjects = read_subjects(paths)
    studies = []
    with threadpool_limits(limits=1, user_api="blas"):
        for subject in subjects:
            if subject.stand_in is None:
                progress.print_line(f"{subject.name}: diagnosing the recording")
            else:
                progress.print_line(f"{subject.name}: {subject.stand_in.remark}")
            found = stages_of(subject)
            with progress.estimator(subject.name) as frames_done:
                studies.append(study_recording(subject, sweep, found, frames_done))
    claims = [*(claim for one in studies for claim in claims_of(one)), *missing_claims(studies)]
    progress.print_line("writing the report")
    with atomic_folder(out, force=force, mark=MARK) as folder:
        write(studies, claims, folder)
    print_table(claims_table(claims), width=UNWRAPPED, spaced=True)
    click.echo(f"\nThe report is in {out / 'report.html'}")
    return 0


def _require_distinct(sweep: SweepSettings) -> None:
    for name, values in (("sweep-features", sweep.features), ("sweep-noise", sweep.pixel_variances)):
        if len(set(values)) < len(values):
            raise InputError(f"{name}: a value is given twice in {', '.join(f'{v:g}' for v in values)}; give each once")


def write(studies: Several[Study], claims: Several[Claim], folder: Path) -> None:
    """Writes all files into an existing, empty folder; NaN and infinity are null in `claims.json`."""
    figures = draw(studies)
    (folder / "figures").mkdir()
    save(figures, folder / "figures", forms=("png", "svg", "pdf"))
    _write_csv(folder / "claims.csv", [asdict(claim) for claim in claims])
    _write_csv(folder / "sweep.csv", [row for study in studies for row in _sweep(study)])
    (folder / "report.html").write_text(render(studies, claims, figures), encoding="utf-8")
    document = {
        "schema": "fgbaseline/reproduction/1",
        "version": version("fgbaseline"),
        "claims": [asdict(claim) for claim in claims],
        "recordings": [_recording(study) for study in studies],
    }
    text = json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)
    (folder / MARK).write_text(text + "\n", encoding="utf-8")


def _recording(study: Study) -> dict[str, Any]:
    subject, studied = study.subject, study.subject.studied
    end = study.predicted[-1, :3, 3]
    return {
        "name": subject.name,
        "source": subject.recorded.source,
        "frames": subject.recorded.n_frames,
        "tracks": studied.n_landmarks,
        "observations": len(studied.observations),
        "simulated": None if subject.stand_in is None else subject.stand_in.remark,
        "dead_reckoning_end": [float(x) for x in np.round(end, 6)],
        "mapped": {str(n): {"before": m.before.record(), "after": m.after.record()} for n, m in study.mapped.items()},
        "stages": [{"stage": s.stage.name, "cause": s.stage.cause, **s.outcome.record()} for s in study.staged],
        "low_noise": {name: outcome.record() for name, outcome in study.low.items()},
        "held": [outcome.record() for outcome in study.held],
        "sweep": [outcome.record() for outcome in study.swept],
        "sweep_repaired": [outcome.record() for outcome in study.swept_repaired],
    }


def _sweep(study: Study) -> list[dict[str, object]]:
    """Rows of the outcomes of the sweep, on the recording as it is and repaired."""
    states = {"as recorded": [*study.swept, *study.held], "repaired": study.swept_repaired}
    name = study.subject.label
    return [{"recording": name, "state": state, **o.record()} for state, runs in states.items() for o in runs]


def _write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
