"""Evidence beside the paths: consistency (NEES, NIS, sigmas), held-out tracks, and landmarks of the reference."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray

from ..formatting import RESOLUTION, per_cent
from .comparison_data import ComparisonData
from .legend import title_and_legend
from .over_time import Panel, time_panels
from .panels import DEGREES_OF_FREEDOM, intervals, log_where_positive, short
from .reprojection import medians_by_class
from .run_data import RunData
from .style import SCREEN, Style, safe_text

AXES = ("x, m", "y, m", "z, m", "rotation x, °", "rotation y, °", "rotation z, °")
QUANTITIES = {
    "velocity": ("velocity", "m/s"),
    "gyroscope_bias": ("gyro bias", "rad/s"),
    "accelerometer_bias": ("acc. bias", "m/s^2"),
}
"""columns of `compare.velocity_and_bias_errors`, and how little room there is for their headings"""
OVER_BAND, BELOW_ONE = "above the band: covariance too small", "below 1: overconfident"


def nees(run: RunData) -> Figure | None:
    """NEES of each pose against ground truth; None without truth or covariances."""
    label, bounds = "NEES (above: overconfident)", "95 % bounds (6 dof)"
    panel = Panel(label, "nees", 3.8 - SCREEN.room, 6.0, degrees=DEGREES_OF_FREEDOM, band=bounds)
    title = "NEES of each pose: squared error over covariance"
    return time_panels(run, [panel], title, SCREEN, linewidth=1.1)


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
    for i, (axis, (e, s)) in enumerate(shown.items()):
        panel = panels[i % 3, i // 3]
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


def map_difference(data: RunData | ComparisonData, style: Style = SCREEN) -> Figure | None:
    """Median distance of landmarks from the reference's by depth; None where none is shared.

    In meters and sigmas, on paper only in the camera frame. Another solver of the reference's graph has no distance in
    sigmas: P - P_ref is zero up to rounding.
    """
    from fgbaseline.compare.estimate_comparison import SAME_GRAPH

    tables = {
        name: table.assign(sigmas=np.nan) if {name, data.reference} <= set(SAME_GRAPH) else table
        for name, table in data.by_depth.items()
    }
    columns = {"distance": "in the world, m", "seen": "in the camera frame, m", "sigmas": "in the world, sigmas"}
    if not style.titled:
        columns = {"seen": ""}
    shown = {c: title for c, title in columns.items() if any(t[c].notna().any() for t in tables.values())}
    if not shown:
        return None
    line = data.line(style, max(map(len, tables.values())))
    figure = Figure(figsize=(style.width, 3.4 if style.titled else 1.7))
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    handles = []
    for panel, (column, title) in zip(panels, shown.items(), strict=True):
        medians = {name: table[column] for name, table in tables.items()}
        handles += medians_by_class(panel, medians, line, style, _depth)
        log_where_positive(panel)
        if column != "sigmas" and panel.get_yscale() == "log" and panel.get_ylim()[1] > RESOLUTION:
            panel.set_ylim(bottom=max(RESOLUTION, panel.get_ylim()[0]))
        panel.set(title=title, xlabel="depth, m")
    if not style.titled:
        panels[0].set_ylabel("distance, m")
    title = f"Landmarks: median distance from those of {safe_text(data.reference or '')}, by depth"
    title_and_legend(figure, title, handles, style)
    return figure


def _depth(name: str) -> str:
    return short(name.replace(" m and more", "+")).removesuffix(" m")


def held_out(run: RunData, style: Style = SCREEN) -> Figure | None:
    """Median error of each path on held-out tracks, with its 95 % interval, best on top; None without any."""
    table = run.held_out
    if table is None:
        return None
    n, colors = len(table), run.colors
    figure = Figure(figsize=(style.width, 1.5 + 0.36 * n if style.titled else 0.6 + 0.2 * n))
    panel = figure.subplots()
    names = [str(name) for name in table["estimator"]]
    low, median, high = (table[column].to_numpy(dtype=np.float64) for column in ("low", "median", "high"))
    rows = zip(range(n), low, median, high, [colors[name] for name in names], strict=True)
    intervals(panel, rows, *((6.0, 2.2) if style.titled else (3.5, 1.6)))
    panel.set_yticks(range(n), [safe_text(name) for name in names])
    panel.set_ylim(n - 0.4, -0.6)
    if style.titled and 0.0 < float(median.min()) < 0.2 * float(median.max()) < np.inf:
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlabel("median held-out error, px" + (", with its 95 % interval" if style.titled else ""))
    held = None if run.run is None else run.run.held_out
    pieces = 0 if held is None or held.errors is None else held.errors.inliers
    title = f"Held-out error: {plural(pieces, 'piece')} of tracks that no estimator used"
    title_and_legend(figure, title, style=style)
    return figure
