"""Figures over time: divergence from the reference, error to ground truth, height, and time per frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.compare.column_tables import Columns
from fgbaseline.geometry import FloatArray

from .axis_limits import common_window, signed_range
from .legend import title_and_legend
from .palette import GRAY
from .panels import (
    CONSISTENT,
    chi_square_band,
    few_ticks,
    fit_log,
    fit_log_or_linear,
    fit_signed,
    note_out_of_range,
    plot_series,
    running_median,
    smoothed,
)
from .run_data import RunData
from .style import SCREEN, Line, Style, safe_text, stacked_panels

if TYPE_CHECKING:
    import pandas as pd

COMPONENTS = {
    "position": "position, m",
    "rotation_deg": "rotation, °",
    "along": "ahead, m",
    "across": "to the left, m",
    "up": "above, m",
}
"""columns of `compare.pose_errors`, as the panels have them"""
SIGNED = ("along", "across", "up")
MIN_HEIGHT_RANGE = 0.1
"""height over extent, up to which any path is shown"""
TITLE_ROOM = 58
"""letters that a title has for numbers"""


@dataclass(frozen=True, slots=True)
class Panel:
    """Quantity of a run's series over time."""

    label: str
    column: str
    height: float
    """inches"""
    decades: float | None = None
    """decades of its logarithmic ordinate, at most; None: logarithmic only where the estimators differ by decades"""
    title: str = ""
    smooth: bool = False
    """whether values vary strongly from frame to frame, so that running medians are drawn"""
    degrees: float | None = None
    """degrees of freedom of the chi-square of a consistent estimator, over `per`, whose band is drawn"""
    per: float = 1.0
    band: str = CONSISTENT
    """the band's entry in the legend"""
    expected: float | None = None
    """value of a consistent estimator"""


def time_panels(run: RunData, wanted: Sequence[Panel], title: str, style: Style, **look: Any) -> Figure | None:
    """Panels that have something to show above one another, `look` being that of the lines; None where none has."""
    shown: dict[Panel, dict[str, FloatArray]] = {}
    for panel in wanted:
        series = run.column(panel.column)
        if panel.smooth:
            series = {name: running_median(values) for name, values in series.items()}
        if not style.titled:  # a line of zeros, such as the time of an estimator without one, says nothing in print
            series = {name: values for name, values in series.items() if np.nansum(np.abs(values))}
        if series:
            shown[panel] = series
    if not shown:
        return None
    heights = [panel.height for panel in shown]
    figure, axes = stacked_panels(style.room + sum(heights), len(shown), style, height_ratios=heights)
    lines: list[Any] = []
    bands: list[Any] = []
    for on, (panel, series) in zip(axes, shown.items(), strict=True):
        lines += plot_series(on, run.t, series, run.line(style), **look)
        if panel.decades is None:
            fit_log_or_linear(on, series)
        else:
            fit_log(on, series, panel.decades)
        if panel.degrees is not None:
            width = 0.9 if style.titled else 0.6
            bands.append(chi_square_band(on, panel.degrees, panel.band, per=panel.per, width=width))
        if panel.expected is not None:
            bottom, top = on.get_ylim()
            on.set_ylim(min(bottom, 0.7 * panel.expected), max(top, 1.4 * panel.expected))
            on.axhline(panel.expected, color=GRAY, linestyle=":", linewidth=0.9, zorder=2.5)
        few_ticks(on, style)
        on.set_ylabel(panel.label)
        remarks = [panel.title, smoothed(len(run.t)) if panel.smooth and style.titled else ""]
        on.set_title(", ".join(filter(None, remarks)))
    time_axis(run, axes, style)
    order = [run.line(style)(name)["label"] for name in run.names]  # a panel may lack the first of them
    title_and_legend(figure, title, [*sorted(lines, key=lambda one: order.index(one.get_label())), *bands], style)
    return figure


def time_axis(run: RunData, axes: Sequence[Axes], style: Style = SCREEN) -> None:
    """Labels the lowest panel and, on the screen, fits all to the recording."""
    if style.titled:
        axes[-1].set_xlim(0.0, float(run.t[-1]))
    axes[-1].set_xlabel("time, s")


def divergence(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Distance, angle and (on the screen) the components of the difference from the reference; None without any."""
    if not style.titled:
        labels = {"divergence_position": "distance, m", "divergence_rotation_deg": "angle, °"}
        return time_panels(run, [Panel(label, column, 0.95) for column, label in labels.items()], "", style)
    names = [name for name in run.names if name != run.reference and "divergence_position" in run.series[name]]
    if not names or run.reference is None:
        return None
    doubt = "" if run.trust == "trusted" else f" ({run.trust})"
    rivals = [name for name in names if name not in run.by_products] or names
    return _errors(run, "divergence", names, f"Divergence from {safe_text(run.reference)}{doubt}", rivals)


def error_to_truth(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Distance, angle and (on the screen) the components of the difference from the unaligned truth; None without."""
    if not style.titled:
        panels = [Panel("error, m", "truth_position", 0.95), Panel("error, °", "truth_rotation_deg", 0.95)]
        return time_panels(run, panels, "", style)
    names = [name for name in run.names if "truth_position" in run.series[name]]
    return _errors(run, "truth", names, "Unaligned error to ground truth", names) if names else None


def component_panels(
    tables: Mapping[str, Columns], t: Mapping[str, FloatArray], line: Line, style: Style = SCREEN
) -> tuple[Figure, list[Axes], list[Any]]:
    """Distance, angle and components of errors (see `compare.pose_errors`) over t, by name, and the lines' handles.

    On paper distance and angle alone.
    """
    every = {c: columns(tables, c) for c in COMPONENTS if style.titled or c not in SIGNED}
    shown = {c: series for c, series in every.items() if any(np.isfinite(v).any() for v in series.values())} or every
    ratios = [1.7 if style.titled else 1.0, *[1.0] * (len(shown) - 1)]
    height = 8.6 * sum(ratios) / 5.7 if style.titled else style.room + 0.95 * sum(ratios)
    figure, axes = stacked_panels(height, len(shown), style, height_ratios=ratios)
    handles: list[Any] = []
    for panel, (column, series) in zip(axes, shown.items(), strict=True):
        for name, values in series.items():
            handles += panel.plot(t[name], values, **line(name))
        panel.set_ylabel(COMPONENTS[column])
        if column in SIGNED:
            panel.axhline(0.0, color="#999999", linewidth=0.8, zorder=1.8)
        else:
            fit_log_or_linear(panel, series)
            few_ticks(panel, style)
    return figure, axes, handles


def columns(tables: Mapping[str, Columns], column: str) -> dict[str, FloatArray]:
    """Values (n,) of a column of each table."""
    return {name: np.asarray(table[column]) for name, table in tables.items()}


def height(run: RunData) -> Figure:
    """Height above the start over time."""
    heights = {name: path[:, 2] for name, path in run.paths.items()}
    true = None if run.truth is None else run.truth[:, 2]
    figure, axes = stacked_panels(3.4)
    handles = axes[0].plot(run.t, true, **SCREEN.truth) if true is not None else []
    handles += plot_series(axes[0], run.t, heights, run.line())
    least = MIN_HEIGHT_RANGE * common_window(run.paths.values(), run.truth).side
    box = common_window([h[:, None] for h in heights.values()], None if true is None else true[:, None], least)
    box = box.grown(0.06 * box.side + 0.05)
    axes[0].set_ylim(float(box.low[0]), float(box.high[0]))
    axes[0].set_ylabel("height, m")
    note_out_of_range(axes[0], run.t, heights, float(box.low[0]), float(box.high[0]))
    time_axis(run, axes)
    title_and_legend(figure, "Height above the start", handles)
    return figure


def time_per_frame(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Time per frame, on the screen beside the interval between frames; None where none is known."""
    if not style.titled:
        return time_panels(run, [Panel("time per frame, s", "seconds", 1.2, decades=5.0, smooth=True)], "", style)
    times = {name: running_median(ms) for name, ms in run.milliseconds().items()}
    if not times:
        return None
    figure, axes = stacked_panels(3.4)
    handles: list[Any] = []
    equal: dict[bytes, list[str]] = {}  # estimators that one run gave
    for name, ms in times.items():
        equal.setdefault(ms.tobytes(), []).append(name)
    for name, *others in equal.values():
        together = " and ".join(map(safe_text, (name, *others)))
        handles += plot_series(axes[0], run.t, {name: times[name]}, run.line(), linewidth=0.9, label=together)
    interval = 1e3 * float(np.median(np.diff(run.t)))
    fit_log(axes[0], times)
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(min(low, interval / 1.5), max(high, 1.5 * interval))
    look: dict[str, Any] = {"color": "#888888", "linewidth": 1.0, "linestyle": ":"}
    real_time = axes[0].axhline(interval, **look, label=f"interval between frames ({interval:.3g} ms)")
    axes[0].set_ylabel("time, ms")
    axes[0].set_title(smoothed(len(run.t)))
    time_axis(run, axes)
    title_and_legend(figure, "Time per frame", [*handles, real_time])
    return figure


def _errors(run: RunData, prefix: str, names: Sequence[str], title: str, rivals: Sequence[str]) -> Figure:
    """Panels of the components, with notes of what leaves them; the title has the maxima of the rivals."""
    tables = {n: _with_prefix(run.series[n], f"{prefix}_") for n in names}
    t = dict.fromkeys(names, run.t)
    figure, axes, handles = component_panels(tables, t, run.line())
    traveled = max((float(np.nanmax(v)) for v in columns(tables, "traveled").values()), default=0.0)
    signed = [np.concatenate([table[column] for column in SIGNED]) for table in tables.values()]
    reach = signed_range(signed, 0.05 * traveled)
    for panel, column in zip(axes, COMPONENTS, strict=True):
        if column in SIGNED:
            fit_signed(panel, run.t, columns(tables, column), reach)
    time_axis(run, axes)
    title_and_legend(figure, title + _maxima({name: tables[name] for name in rivals}), handles)
    return figure


def _with_prefix(table: "pd.DataFrame", prefix: str) -> Columns:
    chosen = [column for column in table.columns if column.startswith(prefix)]
    return {column.removeprefix(prefix): table[column].to_numpy(dtype=np.float64) for column in chosen}


def _maxima(tables: Mapping[str, Columns]) -> str:
    """Largest distance of each, nearest first; the largest of all where there is no room for that."""
    farthest = {n: float(np.nanmax(t["position"])) for n, t in tables.items() if not np.isnan(t["position"]).all()}
    if not farthest:
        return ""
    each = [f"{safe_text(name)} up to {far:.3g} m" for name, far in sorted(farthest.items(), key=lambda item: item[1])]
    name, far = max(farthest.items(), key=lambda item: item[1])
    return ": " + (", ".join(each) if sum(map(len, each)) < TITLE_ROOM else f"at most {far:.3g} m ({safe_text(name)})")
