"""Data of a run as its figures show it, made from a run in memory or from the folder that it left behind."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fgbaseline import compare
from fgbaseline.data import Problem
from fgbaseline.data.formats.named_file import reading
from fgbaseline.data.top_view import TopView
from fgbaseline.geometry import FloatArray, InputError

from ..results.documents import SUMMARY, document_in
from ..results.reader import RunFolder
from .panels import Line
from .style import SCREEN, Style, colors, line, marked_line

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.estimate_comparison import Result, Run


@dataclass(frozen=True, eq=False, slots=True)
class RunDetails:
    """Data that only a run in memory has."""

    problem: Problem
    reprojection: "Mapping[str, pd.DataFrame]"
    """by estimator, one row per observation of its landmarks: see `compare.reprojection`"""
    classes: "Mapping[str, pd.DataFrame]"
    """see `compare.residual_patterns`"""
    directions: Mapping[str, FloatArray]
    """(T, 2) where the camera looks, seen from above"""
    errors: Mapping[str, tuple[FloatArray, FloatArray]]
    """error of each pose in its own body frame (T, 6), and its covariance (T, 6, 6); nothing without truth"""
    held_out_tracks: int


@dataclass(frozen=True, eq=False, slots=True)
class RunData:
    """Run as its figures show it; positions are seen from above: x ahead of the start, y to its left, z up, m."""

    sequence: str
    every: tuple[str, ...]
    """all estimators, which the colors depend on"""
    names: tuple[str, ...]
    """estimators that gave an answer"""
    reference: str | None
    by_products: frozenset[str]
    """estimators that the reference's own run gave, as far as that is known"""
    trust: str
    """in the reference, in one word"""
    t: FloatArray
    """(T,) s since the first frame"""
    paths: Mapping[str, FloatArray]
    """(T, 3) by estimator"""
    truth: FloatArray | None
    """(T, 3)"""
    landmarks: Mapping[str, FloatArray]
    """(m, 3) by estimator, where it has any"""
    series: "Mapping[str, pd.DataFrame]"
    """by estimator, one row per frame, columns as in `series/NAME.csv` and `nis_per_row`"""
    held_out: "pd.DataFrame | None"
    """see `compare.held_out_ranking`, best first; None without held-out tracks"""
    by_depth: "Mapping[str, pd.DataFrame]"
    """by estimator: see `compare.map_by_depth`"""
    observed: RunDetails | None = None
    """None where the data come from a folder"""

    @property
    def colors(self) -> dict[str, str]:
        """Color of every estimator."""
        return colors(self.every, self.reference)

    def line(self, style: Style = SCREEN, points: int | None = None) -> Line:
        """Look of the line of an estimator in a style, with so many points (default: one a frame)."""
        chosen, reference = self.colors, self.reference
        if style is SCREEN:
            return lambda name: line(name, chosen[name], reference)
        others = [name for name in self.names if name != reference]
        n = len(self.t) if points is None else points
        return lambda name: marked_line(name, chosen[name], reference, others, n)

    def column(self, name: str, without: str | None = None) -> dict[str, FloatArray]:
        """(T,) values of a column of the series by estimator, where any of them is finite."""
        values = {n: s[name].to_numpy(dtype=np.float64) for n, s in self.series.items() if name in s and n != without}
        return {n: v for n, v in values.items() if np.isfinite(v).any()}

    @property
    def nis_rows(self) -> float | None:
        """Median number of rows of an innovation, over all frames and estimators that have any; None without one."""
        counts = [s["nis_degrees"].to_numpy(dtype=np.float64) for s in self.series.values() if "nis_degrees" in s]
        seen = np.concatenate([n[n > 0] for n in counts] or [np.empty(0)])
        return float(np.median(seen)) if len(seen) else None


def of_run(run: "Run") -> RunData:
    """Data of a run in memory."""
    answered, sequence, held = run.answered, run.problem.sequence, run.held_out
    view, optical_axis = TopView.of(run.problem), sequence.imu_T_cam[:3, 2]
    landmarks = {r.name: r.estimate.landmarks.position for r in answered}
    maps = {r.name: r.evidence.map for r in answered}
    errors = {r.name: (r.evidence.error, r.estimate.covariance) for r in answered}
    reference = None if run.reference is None else run.results[run.reference].estimate
    return RunData(
        sequence=sequence.name,
        every=tuple(run.results),
        names=tuple(r.name for r in answered),
        reference=run.reference,
        by_products=frozenset() if reference is None else frozenset(reference.by_products),
        trust=run.trust.verdict.name.lower(),
        t=np.asarray(sequence.t - sequence.t[0], dtype=np.float64),
        paths={r.name: view.scene(r.estimate.world_T_imu[:, :3, 3]) for r in answered},
        truth=None if sequence.truth is None else view.scene(sequence.truth.world_T_imu[:, :3, 3]),
        landmarks={name: view.scene(points) for name, points in landmarks.items() if len(points)},
        series={r.name: _series(r, len(sequence.t)) for r in answered},
        held_out=None if held is None or len(held.ranking) == 0 else held.ranking.reset_index(),
        by_depth={name: compare.map_by_depth(m) for name, m in maps.items() if m is not None and len(m)},
        observed=RunDetails(
            problem=run.problem,
            reprojection={r.name: r.reprojection for r in answered},
            classes={r.name: r.evidence.patterns for r in answered if len(r.evidence.patterns)},
            directions={r.name: view.plane(r.estimate.world_T_imu[:, :3, :3] @ optical_axis) for r in answered},
            errors={name: (e, P) for name, (e, P) in errors.items() if e is not None and P is not None},
            held_out_tracks=0 if held is None or held.errors is None else held.errors.inliers,
        ),
    )


def _series(result: "Result", n_frames: int) -> "pd.DataFrame":
    import pandas as pd

    evidence, estimate = result.evidence, result.estimate
    parts: list[tuple[str, pd.DataFrame | None]] = [
        ("divergence", result.divergence),
        ("truth", result.truth),
        ("sigma_ratio", evidence.sigma_ratio),
    ]
    columns: dict[str, Any] = {
        f"{prefix}_{name}": values.to_numpy()
        for prefix, table in parts
        if table is not None
        for name, values in table.items()
    }
    medians = result.reprojection.groupby("frame")["error"].median()
    columns["reprojection_median"] = medians.reindex(range(n_frames)).to_numpy(dtype=np.float64)
    if result.nees is not None:
        columns["nees"] = result.nees
    if evidence.difference is not None:
        columns["nees_reference"] = evidence.difference.nees
    if estimate.innovations is not None:
        columns |= {"nis_per_row": evidence.nis_per_degree, "nis_degrees": estimate.innovations.degrees}
    if result.inertial is not None:
        columns |= {str(name): values.to_numpy() for name, values in result.inertial.series.items()}
    columns["seconds"] = estimate.seconds if len(estimate.seconds) == n_frames else np.full(n_frames, np.nan)
    return pd.DataFrame(columns)


def of_folder(folder: Path) -> RunData:
    """Data of the run that left a folder. Raises InputError, naming the file, where it is none or lacks a file."""
    files = RunFolder(folder)
    document_in(folder, "run or compare")
    summary = files.summary
    with reading(folder / SUMMARY):
        try:
            every = {str(name): e["status"] != "failed" for name, e in summary["estimators"].items()}
            sequence, reference = dict(summary["sequence"]), dict(summary["reference"])
            axes = _axes(sequence)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(f"it is not the summary of a run ({type(error).__name__}: {error})") from error
        names = tuple(name for name, answered in every.items() if answered)
        if not names:
            raise InputError("none of the run's estimators succeeded, so there is nothing to draw; run it again")
    landmarks = {name: files.landmarks(name).position @ axes.T for name in names}
    series = {name: _with_nis_per_row(files.series(name)) for name in names}
    by_depth, t = files.table("map_by_depth"), series[names[0]]["t"].to_numpy(dtype=np.float64)
    truth = files.truth
    return RunData(
        sequence=str(sequence["name"]),
        every=tuple(every),
        names=names,
        reference=reference["name"],
        by_products=frozenset(),
        trust=str(reference["trust"]),
        t=t - t[0],
        paths={name: files.trajectory(name).position @ axes.T for name in names},
        truth=None if truth is None else truth.position @ axes.T,
        landmarks={name: points for name, points in landmarks.items() if len(points)},
        series=series,
        held_out=files.table("held_out"),
        by_depth={}
        if by_depth is None
        else {str(name): part.set_index("depth") for name, part in by_depth.groupby("estimator") if name in names},
    )


def _axes(sequence: Mapping[str, Any]) -> FloatArray:
    """(3, 3) rows ahead, left and up, as the summary has them."""
    if "ahead" not in sequence:
        raise InputError("it was written by an earlier version, which did not say which way is ahead; run it again")
    ahead, up = (np.array(sequence[key], dtype=np.float64) for key in ("ahead", "up"))
    if ahead.shape != (3,) or up.shape != (3,):
        raise InputError("sequence.ahead and sequence.up must be three numbers each; run it again")
    return np.stack([ahead, np.cross(up, ahead), up])


def _with_nis_per_row(table: "pd.DataFrame") -> "pd.DataFrame":
    if "nis" not in table:
        return table
    return table.assign(nis_per_row=table["nis"] / table["nis_degrees"].where(table["nis_degrees"] > 0))
