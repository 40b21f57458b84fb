"""What a run's folder holds of what figures show."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from fgbaseline.data import read_tum
from fgbaseline.data.formats import read_landmarks
from fgbaseline.data.formats.named_file import reading, regular_file
from fgbaseline.geometry import FloatArray, InputError

from ..job import MARK
from ..run_folder import TRUTH_FILE


@dataclass(frozen=True, eq=False, slots=True)
class Drawn:
    """A run as its folder has it; positions are seen from above: x ahead of the start, y to its left, z up, m."""

    sequence: str
    reference: str | None
    trust: str
    names: tuple[str, ...]
    """the estimators that gave an answer"""
    series: Mapping[str, pd.DataFrame]
    """by estimator, one row per frame: `series/NAME.csv`, with `seconds_since_start` in place of `t`"""
    paths: Mapping[str, FloatArray]
    """(n, 3) by estimator"""
    landmarks: Mapping[str, FloatArray]
    """(m, 3) by estimator, where it has any"""
    truth: FloatArray | None
    """(n, 3)"""
    held_out: pd.DataFrame | None
    """`tables/held_out.csv`, best first"""
    by_depth: pd.DataFrame | None
    """`tables/map_by_depth.csv`"""


def read_drawn(folder: Path) -> Drawn:
    """Raises InputError, naming the file, where the folder is not that of a run or lacks a file of it."""
    path = folder / MARK
    if not path.is_file():
        raise InputError(f"{folder}: this folder has no {MARK}; give the folder that fgbaseline run wrote")
    with reading(path):
        try:
            summary = json.loads(regular_file(path).read_text(encoding="utf-8"))
            names = tuple(str(name) for name, e in summary["estimators"].items() if e["status"] != "failed")
            sequence, reference = dict(summary["sequence"]), dict(summary["reference"])
            axes = _axes(sequence)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(f"it is not the summary of a run ({type(error).__name__}: {error})") from error
        if not names:
            raise InputError("none of the run's estimators gave an answer, so there is nothing to draw; run it again")
    landmarks = {name: read_landmarks(folder / "landmarks" / f"{name}.csv").position @ axes.T for name in names}
    return Drawn(
        sequence=str(sequence["name"]),
        reference=reference["name"],
        trust=str(reference["trust"]),
        names=names,
        series={name: _series(folder / "series" / f"{name}.csv") for name in names},
        paths={name: _positions(folder / "trajectories" / f"{name}.tum") @ axes.T for name in names},
        landmarks={name: points for name, points in landmarks.items() if len(points)},
        truth=_positions(folder / TRUTH_FILE) @ axes.T if (folder / TRUTH_FILE).is_file() else None,
        held_out=_table(folder / "tables" / "held_out.csv"),
        by_depth=_table(folder / "tables" / "map_by_depth.csv"),
    )


def _axes(sequence: Mapping[str, Any]) -> FloatArray:
    """(3, 3) rows ahead, left and up, as the summary has them."""
    if "ahead" not in sequence:
        raise InputError("it was written by an earlier version, which did not say which way is ahead; run it again")
    ahead, up = (np.array(sequence[key], dtype=np.float64) for key in ("ahead", "up"))
    if ahead.shape != (3,) or up.shape != (3,):
        raise InputError("sequence.ahead and sequence.up must be three numbers each; run it again")
    return np.stack([ahead, np.cross(up, ahead), up])


def _positions(path: Path) -> FloatArray:
    positions: FloatArray = read_tum(path)[1][:, :3, 3]
    return positions


def _series(path: Path) -> pd.DataFrame:
    table = _table(path)
    if table is None or "t" not in table:
        raise InputError(f"{path}: the file is missing, or has no column t; run it again")
    table.insert(0, "seconds_since_start", table["t"] - table["t"].iloc[0])
    return table.drop(columns="t")


def _table(path: Path) -> pd.DataFrame | None:
    """A CSV file of the run; None where it was not written."""
    if not path.is_file():
        return None
    with reading(path):
        try:
            return pd.read_csv(path)
        except (ValueError, pd.errors.ParserError) as error:
            raise InputError(f"it is not the table that a run writes ({error}); run it again") from error
