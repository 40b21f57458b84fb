"""Consistency: NEES against truth and reference, NIS, sigma ratios, and errors between three sigmas."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.geometry import FloatArray

from .over_time import Expected, Panel, over_time
from .panels import CONSISTENT, DEGREES_OF_FREEDOM, chi_square_band
from .run_data import RunData
from .style import GREEN, SCREEN, Style, head, plain

AXES = ("x, m", "y, m", "z, m", "rotation x, °", "rotation y, °", "rotation z, °")
PRINTED = "95 % if consistent"


def nees(run: RunData) -> Figure | None:
    """NEES of each pose against the truth; None without truth or covariances."""
    label, height = "NEES (above: overconfident)", 3.8 - SCREEN.room
    panel = Panel(label, "nees", height, decades=6.0, expected=_pose_band("95 % bounds (6 dof)"))
    title = "NEES of each pose: its true error against the error it claims"
    return over_time(run, [panel], title, SCREEN, linewidth=1.1)


def consistency(run: RunData, style: Style = SCREEN) -> Figure | None:
    """NEES of the difference from the reference, NIS, and sigmas over the reference's; None without any of these.

    On paper the NEES against the truth is with them.
    """
    if not style.titled:
        pose, innovation = _pose_band(PRINTED, 0.6), _innovation_band(PRINTED, 0.6)
        panels = [
            Panel("NEES", "nees", 0.95, 5.0, pose),
            Panel("NEES of diff.", "nees_reference", 0.95, 5.0, pose),
            Panel("NIS per row", "nis_per_row", 0.95, 5.0, innovation),
            Panel("sigma ratio", "sigma_ratio_position", 0.95, 5.0),
        ]
        return over_time(run, panels, "", style)
    panels = [
        Panel("NEES of difference", "nees_reference", 1.75, 5.0, _pose_band(CONSISTENT)),
        Panel("NIS per row", "nis_per_row", 1.75, 5.0, _innovation_band(CONSISTENT)),
        Panel("position sigma\nover reference's", "sigma_ratio_position", 1.75, 5.0, _one),
        Panel("rotation sigma\nover reference's", "sigma_ratio_rotation", 1.75, 5.0, _one),
    ]
    title = "Consistency without truth: overconfident above the band, conservative below it"
    return over_time(run, panels, title, style, linewidth=1.0)


def _pose_band(label: str, width: float = 0.9) -> Expected:
    return lambda _, axes: [chi_square_band(axes, DEGREES_OF_FREEDOM, label, width=width)]


def _innovation_band(label: str, width: float = 0.9) -> Expected:
    """Band for as many rows as the median frame that has any."""

    def draw(run: RunData, axes: Axes) -> list[Any]:
        rows = run.nis_rows
        return [] if rows is None else [chi_square_band(axes, rows, label, per=rows, width=width)]

    return draw


def _one(_: RunData, axes: Axes) -> list[Any]:
    axes.axhline(1.0, color=GREEN, linewidth=0.9, zorder=1.5)
    return []


def three_sigma(run: RunData, name: str) -> Figure | None:
    """Error of each pose in its own body frame, between three of its sigmas; None without truth or covariances."""
    if run.observed is None or name not in run.observed.errors:
        return None
    error, covariance = run.observed.errors[name]
    if not np.isfinite(error).any() or not np.isfinite(covariance).any():
        return None
    return three_sigma_of(name, run.t, error, covariance, run.line()(name))


def three_sigma_of(
    name: str, t: FloatArray, error: FloatArray, covariance: FloatArray, look: Mapping[str, Any]
) -> Figure:
    """Errors (n, 6) in the body frame at t (n,), s, between three sigmas of their covariances (n, 6, 6)."""
    scale = np.repeat([1.0, np.rad2deg(1.0)], 3)
    with np.errstate(invalid="ignore"):
        sigma = scale * np.sqrt(np.einsum("tii->ti", covariance))
    figure = Figure(figsize=(SCREEN.width, 5.4))
    panels = figure.subplots(3, 2, sharex=True)
    handles: list[Any] = []
    for i, axis in enumerate(AXES):
        panel = panels[i % 3, i // 3]
        e, s = scale[i] * error[:, i], sigma[:, i]
        band = panel.fill_between(t, -3.0 * s, 3.0 * s, color="#d9e2ec", linewidth=0, label="three sigmas")
        drawn = panel.plot(t, e, **{**look, "linewidth": 1.0, "label": "error"})
        panel.set_ylim(-(reach := _reach(e, s)), reach)
        both = np.isfinite(e) & np.isfinite(s) & (s > 0)
        inside = float(np.mean(np.abs(e[both]) <= 3.0 * s[both])) if both.any() else float("nan")
        panel.set_title(f"{axis}: {100.0 * inside:.1f} % inside")
        handles = handles or [*drawn, band]
    for panel in panels[-1]:
        panel.set_xlim(float(t[0]), float(t[-1]))
        panel.set_xlabel("time, s")
    head(figure, f"{plain(name)}: error in its own body frame, and three of its sigmas (99.7 %)", handles)
    return figure


def _reach(error: FloatArray, sigma: FloatArray) -> float:
    """Limit of a panel: over nearly all of the error, and the band as far as that leaves it visible."""
    e = np.abs(error[np.isfinite(error)])
    s = 3.0 * sigma[np.isfinite(sigma)]
    most = float(np.percentile(e, 99)) if len(e) else 0.0
    band = float(np.percentile(s, 98)) if len(s) else 0.0
    return 1.15 * max(most, min(band, 30.0 * most), 1e-9)
