"""How far each estimator is from the reference, and from the truth, over time."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fgbaseline.compare import Verdict
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Run

from .frames import fit_log_or_linear, fit_signed, note_leaving, seconds, time_axis
from .lettering import plain
from .style import TRUTH_LINE, head, line, sheet
from .view import TopView
from .window import common_window, span

PANELS = {
    "position": "distance, m",
    "rotation_deg": "rotation, °",
    "along": "along, m",
    "across": "to the left, m",
    "up": "up, m",
}
"""columns of `compare.pose_errors`, as the panels have them"""
LEVEL = 0.1
"""height over extent, up to which any path is shown"""
ROOM = 58
"""letters that a headline has for figures"""


def divergence(run: Run) -> Figure | None:
    """Distance, angle and the three components of the way from the reference; None where there is nothing to show."""
    tables = {r.name: r.divergence for r in run.answered if r.divergence is not None and r.name != run.reference}
    if not tables or run.reference is None:
        return None
    doubt = "" if run.trust.verdict is Verdict.TRUSTED else f" ({run.trust.verdict.name.lower()})"
    own = run.results[run.reference].estimate.by_products
    farthest = _farthest({name: table for name, table in tables.items() if name not in own} or tables)
    return _panels(run, tables, f"Divergence from {plain(run.reference)}{doubt}{farthest}")


def error_to_truth(run: Run) -> Figure | None:
    """The same from the truth as it is, unaligned; None without truth."""
    tables = {r.name: r.truth for r in run.answered if r.truth is not None}
    return _panels(run, tables, f"Error, unaligned{_farthest(tables)}") if tables else None


def height(run: Run) -> Figure:
    """Height above the start over time."""
    view, t = TopView.of(run.problem), seconds(run)
    positions = [r.estimate.world_T_imu[:, :3, 3] for r in run.answered]
    heights = {r.name: view.height(p) for r, p in zip(run.answered, positions, strict=True)}
    truth = run.problem.sequence.truth
    true = None if truth is None else view.height(truth.world_T_imu[:, :3, 3])
    figure, axes = sheet(3.4)
    handles = axes[0].plot(t, true, **TRUTH_LINE) if true is not None else []
    for result in run.answered:
        handles += axes[0].plot(t, heights[result.name], **line(run, result))
    least = LEVEL * common_window(positions, None if truth is None else truth.world_T_imu[:, :3, 3]).side
    box = common_window([h[:, None] for h in heights.values()], None if true is None else true[:, None], least)
    box = box.grown(0.06 * box.side + 0.05)
    axes[0].set_ylim(float(box.low[0]), float(box.high[0]))
    axes[0].set_ylabel("height, m")
    note_leaving(axes[0], t, heights, float(box.low[0]), float(box.high[0]))
    time_axis(run, axes)
    head(figure, "Height above the start", handles)
    return figure


def _panels(run: Run, tables: Mapping[str, pd.DataFrame], title: str) -> Figure:
    t = seconds(run)
    figure, axes = sheet(8.6, rows=len(PANELS), height_ratios=[1.7, 1.0, 1.0, 1.0, 1.0])
    handles = []
    columns = {c: {name: _array(table, c) for name, table in tables.items()} for c in PANELS}
    travelled = max((float(np.nanmax(_array(table, "travelled"))) for table in tables.values()), default=0.0)
    components = [np.concatenate([columns[c][name] for c in ("along", "across", "up")]) for name in tables]
    reach = span(components, 0.05 * travelled)
    for panel, (column, title_of_axis) in zip(axes, PANELS.items(), strict=True):
        for name, values in columns[column].items():
            handles += panel.plot(t, values, **line(run, run.results[name]))
        panel.set_ylabel(title_of_axis)
        if column in ("position", "rotation_deg"):
            fit_log_or_linear(panel, columns[column])
        else:
            panel.axhline(0.0, color="#999999", linewidth=0.8, zorder=1.8)
            fit_signed(run, panel, columns[column], reach)
    time_axis(run, axes)
    head(figure, title, handles)
    return figure


def _farthest(tables: Mapping[str, pd.DataFrame]) -> str:
    """How far each goes at most, nearest first; only the farthest where there is no room for all."""
    farthest = {name: float(t["position"].max()) for name, t in tables.items() if t["position"].notna().any()}
    if not farthest:
        return ""
    each = [f"{plain(name)} up to {far:.3g} m" for name, far in sorted(farthest.items(), key=lambda item: item[1])]
    return ": " + (", ".join(each) if sum(map(len, each)) < ROOM else each[-1])


def _array(table: pd.DataFrame, column: str) -> FloatArray:
    return table[column].to_numpy(dtype=np.float64)
