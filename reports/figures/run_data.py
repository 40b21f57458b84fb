"""Data of a run as its figures show it, made from a run in memory or from the folder that it left behind."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fgbaseline import compare
from fgbaseline.compare.column_tables import Columns, of_frame
from fgbaseline.data.formats.files.file_errors import reading
from fgbaseline.data.top_view import TopView
from fgbaseline.geometry import FloatArray, InputError

from ..results.json_files import SUMMARY, document_in
from ..results.reader import RunFolder
from .style import SCREEN, Line, Style, colors, lines

if TYPE_CHECKING:
    import pandas as pd

    from fgbaseline.compare.estimate_comparison import Result, Run


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
    """trust in the reference: trusted, doubtful or untrusted"""
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
    run: "Run | None" = None
    """None where the data come from a folder"""

    @property
    def answered(self) -> "list[Result]":
        """Results with a trajectory; none where the data come from a folder."""
        return [] if self.run is None else self.run.answered

    @property
    def colors(self) -> dict[str, str]:
        """Color of every estimator."""
        return colors(self.every, self.reference)

    def line(self, style: Style = SCREEN, points: int | None = None) -> Line:
        """Look of the line of an estimator in a style, with so many points (default: one a frame)."""
        return lines(style, self.colors, self.reference, self.names, len(self.t) if points is None else points)

    def column(self, name: str) -> dict[str, FloatArray]:
        """Values (T,) of a column of the series by estimator, for estimators with a finite one.

        The reference is not compared with itself.
        """
        without = self.reference if name.startswith("divergence_") else None
        values = {n: s[name].to_numpy(dtype=np.float64) for n, s in self.series.items() if name in s and n != without}
        return {n: v for n, v in values.items() if np.isfinite(v).any()}

    def errors(self, name: str, of: str) -> Columns:
        """Columns `OF_...` of an estimator's series without that beginning: see `compare.pose_errors`."""
        columns = of_frame(self.series[name])
        return {c.removeprefix(f"{of}_"): values for c, values in columns.items() if c.startswith(f"{of}_")}

    def milliseconds(self) -> dict[str, FloatArray]:
        """Time per frame (T,), ms, of each estimator that measured it."""
        return {name: 1e3 * seconds for name, seconds in self.column("seconds").items() if seconds.any()}

    @property
    def nis_rows(self) -> float | None:
        """Median number of rows of an innovation, over all frames and estimators that have any; None without one."""
        counts = [s["nis_degrees"].to_numpy(dtype=np.float64) for s in self.series.values() if "nis_degrees" in s]
        seen = np.concatenate([n[n > 0] for n in counts] or [np.empty(0)])
        return float(np.median(seen)) if len(seen) else None


def of_run(run: "Run") -> RunData:
    """Data of a run in memory."""
    answered, sequence, held, view = run.answered, run.problem.sequence, run.held_out, TopView.of(run.problem)
    landmarks = {r.name: r.estimate.landmarks.position for r in answered}
    maps = {r.name: r.evidence.map for r in answered}
    return RunData(
        sequence=sequence.name,
        every=tuple(run.results),
        names=tuple(r.name for r in answered),
        reference=run.reference,
        by_products=run.by_products,
        trust=run.trust.verdict.name.lower(),
        t=np.asarray(sequence.t - sequence.t[0], dtype=np.float64),
        paths={r.name: view.scene(r.estimate.world_T_imu[:, :3, 3]) for r in answered},
        truth=None if sequence.truth is None else view.scene(sequence.truth.world_T_imu[:, :3, 3]),
        landmarks={name: view.scene(points) for name, points in landmarks.items() if len(points)},
        series={r.name: _series(r, len(sequence.t)) for r in answered},
        held_out=None if held is None or len(held.ranking) == 0 else held.ranking.reset_index(),
        by_depth={name: compare.map_by_depth(m) for name, m in maps.items() if m is not None and len(m)},
        run=run,
    )


def _series(result: "Result", n_frames: int) -> "pd.DataFrame":
    import pandas as pd

    evidence, estimate = result.evidence, result.estimate
    parts = {"divergence_": result.divergence, "truth_": result.truth, "sigma_ratio_": evidence.sigma_ratio}
    if result.inertial is not None:
        parts[""] = result.inertial.series
    table = pd.DataFrame(index=pd.RangeIndex(n_frames, name="frame"))
    for prefix, part in parts.items():
        table = table if part is None else table.join(part.add_prefix(prefix))
    table["reprojection_median"] = result.reprojection.groupby("frame")["error"].median()
    if result.nees is not None:
        table["nees"] = result.nees
    if evidence.difference is not None:
        table["nees_reference"] = evidence.difference.nees
    if estimate.innovations is not None:
        table["nis_per_row"], table["nis_degrees"] = evidence.nis_per_degree, estimate.innovations.degrees
    table["seconds"] = estimate.seconds if len(estimate.seconds) == n_frames else np.nan
    return table


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
            raise InputError("none of the run's estimators succeeded, so there is nothing to draw; repeat the run")
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
    """Axes (3, 3) as rows: ahead, left and up, from the summary."""
    if "ahead" not in sequence:
        raise InputError("it was written by an earlier version, which did not say which way is ahead; repeat the run")
    ahead, up = (np.array(sequence[key], dtype=np.float64) for key in ("ahead", "up"))
    if ahead.shape != (3,) or up.shape != (3,):
        raise InputError("sequence.ahead and sequence.up must be three numbers each; repeat the run")
    return np.stack([ahead, np.cross(up, ahead), up])


def _with_nis_per_row(table: "pd.DataFrame") -> "pd.DataFrame":
    if "nis" not in table:
        return table
    return table.assign(nis_per_row=table["nis"] / table["nis_degrees"].where(table["nis_degrees"] > 0))
