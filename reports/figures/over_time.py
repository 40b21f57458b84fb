"""Figures over time: divergence, errors and their 3-sigma bounds, consistency (NEES, NIS), and time per frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.compare.column_tables import Columns
from fgbaseline.geometry import FloatArray

from ..formatting import per_cent
from .layout import title_and_legend
from .panels import (
    COMPONENTS,
    DEGREES_OF_FREEDOM,
    SIGNED,
    TAIL,
    chi_square_band,
    columns,
    component_panels,
    few_ticks,
    fit_log,
    fit_log_or_linear,
    note_out_of_range,
    plot_series,
    running_median,
    smoothed,
    time_axis,
    widen_ordinate,
)
from .run_data import RunData
from .style import GRAY, SCREEN, Style, safe_text, stacked_panels

TITLE_ROOM = 58
"""letters that a title has for numbers"""
AXES = ("x, m", "y, m", "z, m", "rotation x, °", "rotation y, °", "rotation z, °")
QUANTITIES = {
    "velocity": ("velocity", "m/s"),
    "gyroscope_bias": ("gyro bias", "rad/s"),
    "accelerometer_bias": ("acc. bias", "m/s^2"),
}
"""columns of `compare.velocity_and_bias_errors`, and how little room there is for their headings"""
OVER_BAND, BELOW_ONE = "above the band: covariance too small", "below 1: overconfident"


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
    band: str = "95 % if consistent (dotted: median)"
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
            widen_ordinate(on, 0.7 * panel.expected, 1.4 * panel.expected)
            on.axhline(panel.expected, color=GRAY, linestyle=":", linewidth=0.9, zorder=2.5)
        few_ticks(on, style)
        on.set_ylabel(panel.label)
        remarks = [panel.title, smoothed(len(run.t)) if panel.smooth and style.titled else ""]
        on.set_title(", ".join(filter(None, remarks)))
    time_axis(axes, run.t, style)
    order = [run.line(style)(name)["label"] for name in run.names]  # a panel may lack the first of them
    title_and_legend(figure, title, [*sorted(lines, key=lambda one: order.index(one.get_label())), *bands], style)
    return figure


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


def _errors(run: RunData, prefix: str, names: Sequence[str], title: str, rivals: Sequence[str]) -> Figure:
    """Panels of the components, with notes of what leaves them; the title has the maxima of the rivals."""
    tables = {name: run.errors(name, prefix) for name in names}
    figure, axes, handles = component_panels(tables, dict.fromkeys(names, run.t), run.line())
    traveled = max((float(np.nanmax(v)) for v in columns(tables, "traveled").values()), default=0.0)
    reach = _signed_reach([np.concatenate([t[column] for column in SIGNED]) for t in tables.values()], 0.05 * traveled)
    for panel, column in zip(axes, COMPONENTS, strict=True):
        if column in SIGNED:
            _fit_signed(panel, run.t, columns(tables, column), reach)
    time_axis(axes, run.t)
    title_and_legend(figure, title + _maxima({name: tables[name] for name in rivals}), handles)
    return figure


def _maxima(tables: Mapping[str, Columns]) -> str:
    """Largest distance of each, nearest first; the largest of all where there is no room for that."""
    farthest = {n: float(np.nanmax(t["position"])) for n, t in tables.items() if not np.isnan(t["position"]).all()}
    if not farthest:
        return ""
    each = [f"{safe_text(name)} up to {far:.3g} m" for name, far in sorted(farthest.items(), key=lambda item: item[1])]
    name, far = max(farthest.items(), key=lambda item: item[1])
    return ": " + (", ".join(each) if sum(map(len, each)) < TITLE_ROOM else f"at most {far:.3g} m ({safe_text(name)})")


def _signed_reach(series: Sequence[FloatArray], least: float) -> float:
    """Reach of an axis on either side of zero for several series (n,) of signed values.

    To the largest value, unless one series reaches more than 30 times as far as any other and farther than `least`.
    """
    sizes = [size for values in series if len(size := np.abs(values[np.isfinite(values)]))]
    if not sizes:
        return 1.0
    reach = sorted((float(np.percentile(size, 100.0 - TAIL)) for size in sizes), reverse=True)
    second = reach[1] if len(reach) > 1 else 0.0
    trusted = 3.0 * reach[0] if reach[0] <= 30.0 * second else 3.0 * second
    return max(min(max(float(size.max()) for size in sizes), max(trusted, least)), 1e-12)


def _fit_signed(axes: Axes, t: FloatArray, series: Mapping[str, FloatArray], reach: float) -> None:
    """Linear ordinate out to `reach` on either side, with a note of which series (T,) leave it and when."""
    values = np.concatenate([v[np.isfinite(v)] for v in series.values()] or [np.empty(0)])
    low, high = (float(values.min()), float(values.max())) if len(values) else (-reach, reach)
    low, high = max(low, -reach), min(high, reach)
    margin = max(0.06 * (high - low), 1e-9)
    axes.set_ylim(low - margin, high + margin)
    note_out_of_range(axes, t, series, -reach, reach)


def nees(run: RunData) -> Figure | None:
    """NEES of each pose against ground truth; None without truth or covariances."""
    label, bounds = "NEES (above: overconfident)", "95 % bounds (6 dof)"
    panel = Panel(label, "nees", 3.8 - SCREEN.room, 6.0, degrees=DEGREES_OF_FREEDOM, band=bounds)
    return time_panels(run, [panel], "NEES of each pose: squared error over covariance", SCREEN, linewidth=1.1)


def consistency(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Reference NEES, NIS and sigma ratios over time; None without any of these. On paper also the NEES."""
    rows = run.nis_rows
    pose: dict[str, Any] = {"degrees": DEGREES_OF_FREEDOM}
    nis: dict[str, Any] = {"smooth": True, "degrees": rows, "per": rows or 1.0}
    if not style.titled:
        panels = [
            Panel("NEES", "nees", 0.95, 5.0, **pose),
            Panel("ref. NEES", "nees_reference", 0.95, 5.0, **pose),
            Panel("NIS per degree of freedom", "nis_per_row", 0.95, 5.0, **nis),
            Panel("sigma ratio", "sigma_ratio_position", 0.95, 5.0),
        ]
        return time_panels(run, panels, "", style)
    panels = [
        Panel("reference NEES", "nees_reference", 1.95, 5.0, OVER_BAND, **pose),
        Panel("NIS per degree of freedom", "nis_per_row", 1.95, 5.0, OVER_BAND, **nis),
        Panel("sigma ratio,\nposition", "sigma_ratio_position", 1.95, 5.0, BELOW_ONE, expected=1.0),
        Panel("sigma ratio,\nrotation", "sigma_ratio_rotation", 1.95, 5.0, BELOW_ONE, expected=1.0),
    ]
    title = f"Consistency, compared with {safe_text(run.reference)}" if run.reference else "Consistency"
    return time_panels(run, panels, title, style, linewidth=1.0)


def three_sigma(
    name: str, t: FloatArray, error: FloatArray | None, covariance: FloatArray | None, look: Mapping[str, Any]
) -> Figure | None:
    """Errors (n, 6) in the body frame at t (n,), s, with ±3-sigma bounds of their covariances (n, 6, 6).

    None without truth or covariances.
    """
    if error is None or covariance is None or not np.isfinite(error).any() or not np.isfinite(covariance).any():
        return None
    scale = np.repeat([1.0, np.rad2deg(1.0)], 3)
    with np.errstate(invalid="ignore"):
        sigma = scale * np.sqrt(np.einsum("tii->ti", covariance))
    title = f"{safe_text(name)}: error in the body frame, with ±3-sigma bounds (99.7 %)"
    shown = dict(zip(AXES, zip((scale * error).T, sigma.T, strict=True), strict=True))
    return _between_three_sigmas(title, t, shown, look)


def velocity_and_biases(run: RunData, name: str) -> Figure | None:
    """Unaligned errors of velocity and biases with ±3-sigma bounds; None without covariance or truth of any."""
    series = run.series[name]
    shown = {
        f"{heading} {axis}, {unit}": tuple(
            series[column].to_numpy(dtype=np.float64) for column in (f"truth_{q}_{axis}", f"{q}_sigma_{axis}")
        )
        for q, (heading, unit) in QUANTITIES.items()
        for axis in "xyz"
        if f"truth_{q}" in series and series[f"truth_{q}"].notna().any() and series[f"{q}_sigma_x"].notna().any()
    }
    if not shown:
        return None
    title = f"{safe_text(name)}: unaligned errors of velocity and biases, % within the ±3-sigma bounds (99.7)"
    return _between_three_sigmas(title, run.t, shown, run.line()(name))


def _between_three_sigmas(
    title: str, t: FloatArray, shown: Mapping[str, tuple[FloatArray, ...]], look: Mapping[str, Any]
) -> Figure:
    """Columns of three panels, each with an error (n,) and its sigma (n,) by heading."""
    figure = Figure(figsize=(SCREEN.width, 5.4))
    panels = figure.subplots(3, len(shown) // 3, sharex=True, squeeze=False)
    within = " inside" if len(shown) <= 6 else ""  # three columns have no room for it
    handles: list[Any] = []
    for panel, (axis, (e, s)) in zip(panels.T.ravel(), shown.items(), strict=True):
        band = panel.fill_between(t, -3.0 * s, 3.0 * s, color="#d9e2ec", linewidth=0, label="±3-sigma bounds")
        drawn = panel.plot(t, e, **{**look, "linewidth": 1.0, "label": "error"})
        panel.set_ylim(-(reach := _reach(e, s)), reach)
        both = np.isfinite(e) & np.isfinite(s) & (s > 0)
        inside = float(np.mean(np.abs(e[both]) <= 3.0 * s[both])) if both.any() else float("nan")
        panel.set_title(f"{axis}: {per_cent(inside)}{within}")
        handles = handles or [*drawn, band]
    for panel in panels[-1]:
        panel.set_xlim(float(t[0]), float(t[-1]))
        panel.set_xlabel("time, s")
    title_and_legend(figure, title, handles)
    return figure


def _reach(error: FloatArray, sigma: FloatArray) -> float:
    """Limit of a panel: over nearly all of the error, and the band as far as that leaves it visible."""
    e = np.abs(error[np.isfinite(error)])
    s = 3.0 * sigma[np.isfinite(sigma)]
    most = float(np.percentile(e, 99)) if len(e) else 0.0
    band = float(np.percentile(s, 98)) if len(s) else 0.0
    return 1.15 * max(most, min(band, 30.0 * most), 1e-9)


def time_per_frame(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Time per frame, on the screen beside the interval between frames; None where none is known."""
    if not style.titled:
        return time_panels(run, [Panel("time per frame, s", "seconds", 1.2, decades=5.0, smooth=True)], "", style)
    times = {name: running_median(ms) for name, ms in run.milliseconds().items()}
    if not times:
        return None
    figure, (axes,) = stacked_panels(3.4)
    handles: list[Any] = []
    equal: dict[bytes, list[str]] = {}  # estimators that one run gave
    for name, ms in times.items():
        equal.setdefault(ms.tobytes(), []).append(name)
    for name, *others in equal.values():
        together = " and ".join(map(safe_text, (name, *others)))
        handles += plot_series(axes, run.t, {name: times[name]}, run.line(), linewidth=0.9, label=together)
    interval = 1e3 * float(np.median(np.diff(run.t)))
    fit_log(axes, times)
    widen_ordinate(axes, interval / 1.5, 1.5 * interval)
    look: dict[str, Any] = {"color": "#888888", "linewidth": 1.0, "linestyle": ":"}
    real_time = axes.axhline(interval, **look, label=f"interval between frames ({interval:.3g} ms)")
    axes.set(ylabel="time, ms", title=smoothed(len(run.t)))
    time_axis([axes], run.t)
    title_and_legend(figure, "Time per frame", [*handles, real_time])
    return figure
