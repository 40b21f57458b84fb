"""The section beyond the paths: one compact table, what its columns mean, and the long tables to be unfolded."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fgbaseline.reports.comparison import Run
from fgbaseline.reports.run_tables import map_by_depth

from ..formatting import counted
from .table import Column, Table, table_of

EVIDENCE = ("held_out", "three_sigma_", "reprojection_classes", "map_difference")
"""beginnings of the names of the figures that stand here"""
HELD_OUT, CONSISTENCY, RESIDUALS, MAP = "held-out tracks", "consistency", "tracks", "landmarks"
NOT_COVARIANCES = Column(CONSISTENCY, "not positive definite", ("covariance", "not_positive_definite"))
"""shown only where there are any"""
COLUMNS = (
    Column(HELD_OUT, "median, px", ("held_out", "median"), best=-1),
    Column(HELD_OUT, "behind the best, px", ("held_out", "behind")),
    Column(HELD_OUT, "by at least, px", ("held_out", "behind_low")),
    Column(CONSISTENCY, "NEES, mean", ("nees", "mean")),
    Column(CONSISTENCY, "NEES of difference, median", ("nees_reference", "median")),
    Column(CONSISTENCY, "frames left out", ("nees_reference", "left_out")),
    Column(CONSISTENCY, "NIS per row", ("nis", "per_degree")),
    Column(CONSISTENCY, "position sigma over reference's", ("sigma_ratio", "position")),
    NOT_COVARIANCES,
    Column(RESIDUALS, "squared residuals over expected", ("whitened", "ratio")),
    Column(RESIDUALS, "points that moved, %", ("moved_points", "share"), 100.0),
    Column(MAP, "median distance, m", ("map", "median")),
    Column(MAP, "as seen, m", ("map", "median_seen")),
    Column(MAP, "sigmas", ("map", "median_sigmas")),
)
EXPLAINED: Mapping[str, str] = {
    HELD_OUT: "Held-out tracks were kept from diagnosis and estimators; each half is predicted from the other half "
    "along each path. They judge motion over a second or two as these cameras see it, not drift. Where 'by at least' "
    "is not above 0 the path cannot be told from the best.",
    CONSISTENCY: "Expected of who knows their errors: 6 for NEES (5.35 in the median), 1 for NIS per row, sigmas above "
    "the reference's. The NEES of the difference has P − P_ref as covariance, as filter and reference share their "
    "data; frames where that is not positive definite are left out.",
    RESIDUALS: "Squared residuals of a track over the noise assumed: 1 is expected. Points moved, or their tracks "
    "slid, where a straight motion explains the residuals.",
    MAP: "Landmarks are matched with the reference's by number; 'as seen' is in the frame of each one's own camera, "
    "without drift; 1.54 sigmas are expected.",
}


@dataclass(frozen=True, slots=True)
class Explained(Table):
    """A table with a sentence on each group of its columns."""

    explained: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Folded:
    """A long table."""

    title: str
    headings: list[str]
    rows: list[list[str | float | int]]


def evidence_table(run: Run, estimators: Mapping[str, Mapping[str, Any]]) -> Explained:
    """One row per estimator that answered; columns that none has are left out."""
    any_bad = any((e.get("covariance") or {}).get("not_positive_definite") for e in estimators.values())
    table = table_of(run, estimators, [c for c in COLUMNS if c is not NOT_COVARIANCES or any_bad])
    shown = tuple(EXPLAINED[group] for group, _ in table.groups)
    rows = [row for row in table.rows if row.cells]
    return Explained(table.groups, table.headings, rows, table.notes, shown)


def folded_tables(run: Run) -> list[Folded]:
    """Reprojection in classes, the map by depth and the points that moved, where a run has them."""
    return [table for table in (_classes(run), _map(run), _moved(run)) if table.rows]


def _classes(run: Run) -> Folded:
    rows: list[list[str | float | int]] = [
        [r.name, row["by"], row["of"], int(row["n"]), row["median"], row["mean"], row["p95"], row["u"], row["v"]]
        for r in run.answered
        for row in r.evidence.patterns.to_dict("records")
    ]
    headings = ["estimator", "by", "class", "n", "median, px", "mean, px", "95 %, px", "mean u, px", "mean v, px"]
    return Folded("Reprojection errors by distance, track age, place in the image and camera", headings, rows)


def _map(run: Run) -> Folded:
    rows: list[list[str | float | int]] = []
    for r in run.answered:
        table = map_by_depth(r)
        for row in [] if table is None else table.to_dict("records"):
            rows.append([r.name, str(row["depth"]), int(row["n"]), row["distance"], row["seen"], row["sigmas"]])
    headings = ["estimator", "depth", "landmarks", "distance, m", "as seen, m", "sigmas"]
    return Folded("Landmarks beside the reference's, medians by depth", headings, rows)


MOST_MOVED = 100


def _moved(run: Run) -> Folded:
    """Of the reference, which is the one to be believed; without one, of nobody."""
    if run.reference is None:
        return Folded("", [], [])
    table = run.results[run.reference].evidence.moved
    moved = table[table["moved"]].sort_values("gain", ascending=False)
    rows: list[list[str | float | int]] = [
        [str(row["landmark"]), int(row["n"]), row["speed"], row["squared"], row["gain"]]
        for row in moved.head(MOST_MOVED).to_dict("records")
    ]
    more = f", the clearest {MOST_MOVED}" if len(moved) > MOST_MOVED else ""
    title = f"{counted(len(moved), 'track')} whose points moved or slid, as {run.reference} sees them{more}"
    return Folded(title, ["landmark", "sights", "speed, m/s", "squared residuals", "of these explained"], rows)
