"""Data of a comparison as its figures and plots show it, made from one in memory or from the folder it left behind."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fgbaseline import compare
from fgbaseline.compare import Align
from fgbaseline.compare.column_tables import Columns, of_frame
from fgbaseline.data.formats.files.file_errors import reading
from fgbaseline.data.top_view import TopView
from fgbaseline.geometry import FloatArray, InputError

from ..results.json_files import COMPARISON
from ..results.reader import RunFolder
from .style import SCREEN, Line, Style, colors, lines

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.trajectory_comparison.comparison import Comparison

ALIGNED = {
    Align.NONE: "not aligned",
    Align.FIRST_POSE: "first poses aligned",
    Align.YAW: "yaw and position aligned",
    Align.SE3: "SE(3)-aligned",
    Align.SIM3: "Sim(3)-aligned",
}
PAIRS = {True: "all pairs", False: "consecutive pairs"}
LENGTHS = {True: "KITTI's lengths", False: "lengths fitted to the trajectory, not KITTI's"}
"""whether lengths are those of the KITTI devkit -> words"""


@dataclass(frozen=True, eq=False)
class ComparisonData:
    """Comparison as its figures show it; positions are from the reference's start, the last axis is up, m."""

    reference: str
    names: tuple[str, ...]
    """estimates, in the order of the input"""
    alignment: str
    """alignment of all estimates, in words"""
    up: FloatArray
    """(3,) in the reference's world"""
    stamped: bool
    """False: t is a frame number"""
    t: Mapping[str, FloatArray]
    """(n,) s since the reference's first pose, by estimate: its pairs of poses"""
    paths: Mapping[str, FloatArray]
    """(n, 3) by name, aligned; the whole path of the reference, the paired poses of each estimate"""
    series: Mapping[str, Columns]
    """by estimate, one row per pair: see `compare.divergence_along_path`"""
    rmse: Mapping[str, float]
    """position RMSE over the common stamps, m, of the ranked estimates, nearest first"""
    relative: Mapping[str, Mapping[str, Columns]]
    """by delta, then estimate: `translation`, m, and `rotation_deg` of each motion"""
    pairs: str
    """choice of the pairs of poses of `relative`, in words"""
    segments: Mapping[str, Columns]
    """by estimate, KITTI's segment errors: see `SegmentErrors.means_by_length`"""
    lengths: str
    """lengths of the segments, in words"""
    by_depth: "Mapping[str, pd.DataFrame]"
    """by estimate: see `compare.map_by_depth`"""

    @property
    def colors(self) -> dict[str, str]:
        """Color of each trajectory; the reference is black."""
        return colors([self.reference, *self.names], self.reference)

    def line(self, style: Style = SCREEN, points: int | None = None) -> Line:
        """Look of the line of a trajectory in a style, with so many points (default: one a pair)."""
        n = max(map(len, self.t.values())) if points is None else points
        return lines(style, self.colors, self.reference, self.names, n)

    @cached_property
    def view(self) -> TopView:
        """The plane seen from above: along the world's own axes where up is one of them."""
        return level_view(self.up)

    @property
    def axes(self) -> tuple[str, str, str]:
        """Names of the axes of the scene."""
        return named_axis(self.view.ahead), named_axis(self.view.left), "up"


def level_view(up: FloatArray) -> TopView:
    """Plane across `up`, along the world's own axes where up is one of them."""
    ahead = next(axis - (axis @ up) * up for axis in np.eye(3) if abs(axis @ up) < 0.7)
    ahead = ahead / np.linalg.norm(ahead)
    return TopView(ahead, np.cross(up, ahead), up)


def named_axis(direction: FloatArray) -> str:
    """World's axis that a direction is, or is nearest to once made level."""
    k = int(np.argmax(np.abs(direction)))
    sign = "" if direction[k] > 0 else "\N{MINUS SIGN}"
    return f"{sign}{'xyz'[k]}" + ("" if abs(direction[k]) > 1 - 1e-9 else ", level")


def of_comparison(comparison: "Comparison") -> ComparisonData:
    """Data of a comparison in memory."""
    path, results = comparison.reference.trajectory, comparison.results
    view, start = level_view(comparison.up), path.position[0]
    ranking = comparison.ranking
    positions = {path.name: path.position} | {n: r.matched.estimate.position for n, r in results.items()}
    segments = {name: r.segments for name, r in results.items() if r.segments is not None}
    maps = {name: r.map for name, r in results.items() if r.map is not None}
    return ComparisonData(
        reference=path.name,
        names=tuple(results),
        alignment=ALIGNED[next(iter(results.values())).matched.alignment.kind],
        up=comparison.up,
        stamped=path.stamped,
        t={name: np.asarray(r.matched.reference.t - path.t[0]) for name, r in results.items()},
        paths={name: view.scene(p - start) for name, p in positions.items()},
        series={name: r.divergence for name, r in results.items()},
        rmse={name: ranking.rmse(name) for name in ranking.rivals or ranking.at},
        relative=_by_delta({name: r.relative for name, r in results.items()}),
        pairs=PAIRS[comparison.settings.all_pairs],
        segments={name: found.means_by_length for name, found in segments.items()},
        lengths=LENGTHS[all(found.official for found in segments.values())],
        by_depth={name: compare.map_by_depth(table) for name, table in maps.items()},
    )


def of_comparison_folder(folder: Path) -> ComparisonData:
    """Data of the comparison that left a folder. Raises InputError, naming the file, where one is missing or bad."""
    files = RunFolder(folder, COMPARISON)
    summary = files.summary
    with reading(folder / COMPARISON):
        try:
            return _of_files(files, summary)
        except (KeyError, TypeError, ValueError, AttributeError, StopIteration) as error:
            raise InputError(
                f"it is not that of a comparison ({type(error).__name__}: {error}); repeat the comparison"
            ) from error


def _of_files(files: RunFolder, summary: Mapping[str, Any]) -> ComparisonData:
    import pandas as pd

    reference, estimates = summary["reference"], dict(summary["estimates"])
    up = np.array(summary["up"]["direction"], dtype=np.float64)
    path = files.trajectory(reference["name"])
    view, start = level_view(up), path.position[0]
    positions = {path.name: path.position} | {name: files.trajectory(name).position for name in estimates}
    series = {name: files.series(name) for name in estimates}
    ranks = sorted((e["rank"], name) for name, e in estimates.items() if e["rank"] is not None)
    segments = {name: e["segments"] for name, e in estimates.items() if e["segments"] is not None}
    relative = {name: files.table(name, "relative") for name in estimates}
    maps = {name: files.table(name, "maps") for name in estimates}
    return ComparisonData(
        reference=path.name,
        names=tuple(estimates),
        alignment=ALIGNED[Align(next(iter(estimates.values()))["alignment"]["kind"])],
        up=up,
        stamped=reference["duration_s"] is not None,
        t={name: table["t"].to_numpy(dtype=np.float64) - path.t[0] for name, table in series.items()},
        paths={name: view.scene(p - start) for name, p in positions.items()},
        series={name: of_frame(table) for name, table in series.items()},
        rmse={name: float(estimates[name]["common"]["rmse"]["value"]) for _, name in ranks},
        relative=_by_delta(
            {
                name: {str(delta): of_frame(of) for delta, of in table.groupby("delta", sort=False)}
                for name, table in relative.items()
                if table is not None
            }
        ),
        pairs=PAIRS[bool(summary["settings"]["all_pairs"])],
        segments={name: of_frame(pd.DataFrame(found["by_length"])) for name, found in segments.items()},
        lengths=LENGTHS[all(found["official"] for found in segments.values())],
        by_depth={name: compare.map_by_depth(table) for name, table in maps.items() if table is not None},
    )


def _by_delta(relative: Mapping[str, Mapping[str, Columns]]) -> dict[str, dict[str, Columns]]:
    """Tables by delta, then estimate, of those by estimate, then delta."""
    deltas = dict.fromkeys(delta for tables in relative.values() for delta in tables)
    return {delta: {n: tables[delta] for n, tables in relative.items() if delta in tables} for delta in deltas}
