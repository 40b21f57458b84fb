"""The folder of a reproduction: figures, claims and sweep as tables, and the page."""

import csv
import json
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from fgbaseline.reports.figures.reproduction import draw

from ..figures import save
from .claims import Claim
from .page import render
from .study import Study
from .trial import Outcome

MARK = "claims.json"
"""the file by which a reproduction's folder is known"""


@dataclass(frozen=True, eq=False, slots=True)
class Reproduction:
    """Studies and claims of all recordings."""

    studies: list[Study]
    claims: list[Claim]


def write(reproduction: Reproduction, folder: Path) -> None:
    """Fills an existing, empty folder."""
    figures = draw(reproduction.studies)
    (folder / "figures").mkdir()
    save(figures, folder / "figures", forms=("png", "svg", "pdf"))
    _tables(reproduction, folder)
    page = render(reproduction.studies, reproduction.claims, figures)
    (folder / "report.html").write_text(page, encoding="utf-8")
    text = json.dumps(as_dict(reproduction), indent=2, allow_nan=False, ensure_ascii=False)
    (folder / MARK).write_text(text + "\n", encoding="utf-8")


def as_dict(reproduction: Reproduction) -> dict[str, Any]:
    """`claims.json`: what is not a number is null."""
    return {
        "schema": "fgbaseline/reproduction/1",
        "version": version("fgbaseline"),
        "claims": [asdict(claim) for claim in reproduction.claims],
        "recordings": [_recording(study) for study in reproduction.studies],
    }


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


def _tables(reproduction: Reproduction, folder: Path) -> None:
    claims = [asdict(claim) for claim in reproduction.claims]
    sweep: list[dict[str, object]] = []
    for study in reproduction.studies:
        every: list[tuple[str, list[Outcome]]] = [
            ("as recorded", [*study.swept, *study.held]),
            ("repaired", study.swept_repaired),
        ]
        name = study.subject.label
        sweep += [{"recording": name, "state": state, **o.record()} for state, runs in every for o in runs]
    for name, rows in (("claims", claims), ("sweep", sweep)):
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
