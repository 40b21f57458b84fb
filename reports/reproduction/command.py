"""`fgbaseline reproduce`: recordings, studies, claims, and the folder with figures, tables and page."""

import json
from collections.abc import Mapping
from collections.abc import Sequence as Several
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits

from fgbaseline.data.formats.files.atomic_folder import atomic_folder, require_free
from fgbaseline.data.wording import plural
from fgbaseline.geometry import InputError

from ..figures import save
from ..formatting import meters, number, per_cent
from ..html.page import Block, Grid, Note, Page, Pair, Section, pictures, render_page
from ..progress import reporter
from ..results.glossary import INERTIAL_TERMS, TERMS
from ..tables.table import Column, Row, Table, numbers, words
from ..tables.writers import print_table
from .claims import Claim, Verdict, claims_of, missing_claims
from .experiments import Outcome, Study, SweepSettings, stages_of, study_recording
from .figures import draw
from .recordings import read_subjects

MARK = "claims.json"
"""the file that marks a reproduction's folder"""
UNWRAPPED = 150
"""columns of the table where no terminal says how many there are"""
BADGES: Mapping[str, str] = {
    Verdict.HOLDS: "trusted",
    Verdict.IN_PART: "doubtful",
    Verdict.FALSE: "untrusted",
    Verdict.CANNOT_TELL: "",
}
"""style of each verdict: good, fair and poor"""
STAGES = (
    *words("repaired"),
    *numbers("from dead reckoning, RMS", "largest"),
    Column("reprojection", unit="px"),
    *numbers("cheirality violated", "frames, not positive definite", "correction per update, RMS"),
)
CAPTIONS: Mapping[str, str] = {
    "sweep": "Landmarks updated in turn with the pose, W as in the source paper. Numbers: RMS distance from dead "
    "reckoning (darker: larger), and frames where the printed covariance is not positive definite. Below: the filter "
    "of figure 9 after one repair after another, and the share of observations that violate cheirality.",
    "causes_": "Each panel has the repairs of the one before. Distances: RMS from the dead reckoning of the same "
    "panel.",
}
"""captions by the beginning of a figure's name"""
NUMBERED = (
    "In the order and under the numbers of the report; x and y of the world as it plots them, seen along z of the IMU "
    "at the start."
)


def reproduce(paths: Several[Path], out: Path, sweep: SweepSettings, *, force: bool) -> int:
    """Studies the recordings, writes the folder and prints the claims; returns 0.

    Raises InputError for an invalid recording, and where the folder exists or cannot be written.
    """
    require_free(out, force=force, mark=MARK)
    _require_distinct(sweep)
    progress, studies = reporter(), []
    subjects = read_subjects(paths)
    with threadpool_limits(limits=1, user_api="blas"):
        for subject in subjects:
            doing = "diagnosing the recording" if subject.stand_in is None else subject.stand_in.remark
            progress.print_line(f"{subject.name}: {doing}")
            found = stages_of(subject)
            with progress.estimator(subject.name) as frames_done:
                studies.append(study_recording(subject, sweep, found, frames_done))
    claims = [*(claim for one in studies for claim in claims_of(one)), *missing_claims(studies)]
    progress.print_line("writing the report")
    with atomic_folder(out, force=force, mark=MARK) as folder:
        write(studies, claims, folder)
    print_table(_terminal_table(claims), width=UNWRAPPED, spaced=True)
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
    tables = {"claims.csv": map(asdict, claims), "sweep.csv": (row for study in studies for row in _sweep(study))}
    for file, rows in tables.items():
        table = pd.DataFrame(list(rows), dtype=object)  # integers beside missing values stay integers
        table.to_csv(folder / file, index=False, lineterminator="\r\n")
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


def render(studies: Several[Study], claims: Several[Claim], figures: Mapping[str, Figure]) -> str:
    """The page `report.html`; text from files is escaped."""
    drawn = pictures(figures, CAPTIONS)
    numbered = [p for name, p in drawn.items() if name.startswith("figure_")]
    others = [p for name, p in drawn.items() if not name.startswith(("figure_", *CAPTIONS))]
    stand_ins = [
        Note(f"{subject.name}. {subject.stand_in.remark} The results of its SLAM are those of this simulation.")
        for subject in (study.subject for study in studies)
        if subject.stand_in is not None
    ]
    paper: list[Block] = [Note(NUMBERED), Pair(numbered)] if numbered else []
    if others:
        paper += [Note("Of the same kind, not in the report", is_heading=True), Pair(others)]
    stages: list[Block] = [p for name, p in drawn.items() if name.startswith("causes_")]
    stages += [Grid(_stages(study), "stages", is_titled=True) for study in studies]
    return render_page(
        Page(
            kind="reproduction",
            title="The report on the documented filter, reproduced",
            about=" ".join(_about(study) for study in studies),
            verdict=[sentence for study in studies for sentence in sentences(study)],
            table=Section(
                "claims",
                "The report's claims",
                [*stand_ins, Grid(_page_table(claims), "plain claims", BADGES)],
                "Claims",
            ),
            sections=[
                Section("sweep", "Where the filter breaks, and why", [drawn["sweep"]], "Where it breaks"),
                Section("figures", "Figures of the source paper", paper, "Figures"),
                Section("stages", "Cause by cause", stages),
            ],
            terms=TERMS.keys() - INERTIAL_TERMS.keys(),
        )
    )


def _about(study: Study) -> str:
    recorded, studied = study.subject.recorded, study.subject.studied
    return (
        f"{study.subject.label}: {number(recorded.n_frames)} frames, {number(len(studied.observations))} stereo "
        f"observations of {number(studied.n_landmarks)} tracks."
    )


def _page_table(claims: Several[Claim]) -> Table:
    columns = words("of", "verdict", "measured", "behind it", "on the repaired recording")
    rows = [
        Row.of(
            c.claim,
            f"{c.recording}{' (simulated features)' if c.simulated else ''}",
            c.verdict,
            c.measured,
            c.cause,
            c.repaired or "–",
        )
        for c in claims
    ]
    return Table(columns, tuple(rows), name="the report says")


def _terminal_table(claims: Several[Claim]) -> Table:
    columns = words("claim of the source paper", "verdict", "measured")
    rows = [
        Row.of(f"{c.recording}{' (simulated)' if c.simulated else ''}", c.claim, c.verdict, c.measured) for c in claims
    ]
    return Table(columns, tuple(rows), name="recording")


def _stages(study: Study) -> Table:
    """Table of the documented filter after each repair of a recording."""
    truth = study.subject.studied.truth is not None
    rows = []
    for staged in study.staged:
        o = staged.outcome
        texts = [staged.stage.cause or "–", meters(o.apart_rmse), meters(o.apart_max), number(o.reprojection)]
        texts += [per_cent(o.behind), number(o.lost), meters(o.correction_m)]
        texts += [meters(o.truth_rmse)] if truth else []
        rows.append(Row.of(staged.stage.name, *texts))
    columns = (*STAGES, *(numbers("from ground truth, RMS") if truth else ()))
    return Table(columns, tuple(rows), name="stage", title=study.subject.label)


def sentences(study: Study) -> list[str]:
    """Two sentences on a recording: the filter on the data as recorded, and on the repaired data."""
    label, now, then = study.subject.label, study.recorded, study.repaired
    first = (
        f"{label}: the documented filter with {now.features} features and V = {now.settings.pixel_variance:g} I is "
        f"{_state(now)}."
    )
    if not study.causes:
        return [first, f"{label}: no fault detected."]
    return [first, f"{label}, repaired ({'; '.join(study.causes)}): it is {_state(then)}."]


def _state(outcome: Outcome) -> str:
    lost = f"not positive definite at {plural(outcome.lost, 'frame')}" if outcome.lost else "always positive definite"
    return (
        f"{meters(outcome.apart_rmse)} (RMS) from dead reckoning with a median reprojection error of "
        f"{outcome.reprojection:.3g} px, its printed covariance {lost}"
    )
