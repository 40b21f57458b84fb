"""Folder of `fgbaseline run`, read back: its reference with the trust in it, its paths and landmarks."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fgbaseline.compare import Trust, Verdict
from fgbaseline.data import Landmarks
from fgbaseline.data.formats import read_landmarks, read_trajectory
from fgbaseline.data.formats.named_file import reading, regular_file
from fgbaseline.data.trajectory import Trajectory
from fgbaseline.geometry import InputError
from fgbaseline.reports.run.problem import MARK


@dataclass(frozen=True, slots=True)
class RunFolder:
    """Summary of a run, and its files."""

    folder: Path
    reference: str
    trust: Trust
    names: tuple[str, ...]
    """the estimators that gave an answer"""
    settings: dict[str, Any]
    up: tuple[float, ...] | None
    """up in the world of its trajectories; None in the summaries of older runs"""

    def trajectory(self, name: str) -> Trajectory:
        """Path of an estimator; raises InputError."""
        return read_trajectory(self.folder / "trajectories" / f"{name}.tum", "tum", name=name)

    def landmarks(self, name: str) -> Landmarks:
        """Landmarks of an estimator; raises InputError."""
        return read_landmarks(self.folder / "landmarks" / f"{name}.csv")


def read_run_folder(folder: Path) -> RunFolder:
    """Reads the summary. Raises InputError, naming the file, where the folder is not that of a run with a reference."""
    path = folder / MARK
    if not path.is_file():
        raise InputError(
            f"{folder}: this folder has no {MARK}, so it is not that of a run; give a trajectory file, or the folder "
            "that fgbaseline run wrote"
        )
    with reading(path):
        try:
            summary = json.loads(regular_file(path).read_text(encoding="utf-8"))
            reference, estimators = summary["reference"], summary["estimators"]
            chosen = str(reference["name"])
            trust = Trust(Verdict[str(reference["trust"]).upper()], tuple(map(str, reference["reasons"])))
            names = tuple(str(name) for name, e in estimators.items() if e["status"] != "failed")
            settings = dict(summary["settings"])
            up = summary["sequence"].get("up")
            up = None if up is None else tuple(map(float, up))
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
            raise InputError(f"it is not the summary of a run ({type(error).__name__}: {error})") from error
        if chosen not in names:
            raise InputError("the run has no reference: none of its estimators gave an answer; run it again")
    return RunFolder(folder, chosen, trust, names, settings, up)
