"""Whether an estimator knows its errors: beside the reference, in its innovations, and against truth."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fgbaseline.compare import chi_square_bounds
from fgbaseline.geometry import FloatArray
from fgbaseline.reports.comparison import Result, Run

from .frames import fit_log, seconds, time_axis
from .lettering import plain
from .style import head, line, sheet

BAND: dict[str, Any] = {"color": "#d7e8d9", "zorder": 1, "linewidth": 0}
MIDDLE: dict[str, Any] = {"color": "#6b9a72", "linewidth": 0.9, "zorder": 1.5}
AXES = ("x, m", "y, m", "z, m", "rotation x, °", "rotation y, °", "rotation z, °")


def consistency(run: Run) -> Figure | None:
    """NEES of the difference from the reference, NIS, and sigmas over the reference's; None without any of these."""
    panels = [
        ("NEES of difference", {r.name: r.evidence.difference.nees for r in run.answered if r.evidence.difference}),
        ("NIS per row", {r.name: r.evidence.nis_per_degree for r in run.answered}),
        ("position sigma\nover reference's", _ratio(run, "position")),
        ("rotation sigma\nover reference's", _ratio(run, "rotation")),
    ]
    known = [(name, {n: v for n, v in series.items() if np.isfinite(v).any()}) for name, series in panels]
    known = [(name, series) for name, series in known if series]
    if not known:
        return None
    figure, axes = sheet(1.2 + 1.75 * len(known), len(known))
    handles: list[Any] = []
    for panel, (name, series) in zip(axes, known, strict=True):
        for estimator, values in series.items():
            style = {**line(run, run.results[estimator]), "linewidth": 1.0}
            handles += panel.plot(seconds(run), values, **style)
        fit_log(panel, series, decades=5.0)
        handles += _expected(panel, name, run)
        panel.set_ylabel(name)
    time_axis(run, axes)
    head(figure, "Consistency without truth: above the band too sure of itself, below it too timid", handles)
    return figure


def three_sigma(run: Run, result: Result) -> Figure | None:
    """The error of each pose in its own body frame, between three of its sigmas; None without truth or covariances."""
    error, covariance = result.evidence.error, result.estimate.covariance
    if error is None or covariance is None or not np.isfinite(error).any() or not np.isfinite(covariance).any():
        return None
    return three_sigma_of(result.name, seconds(run), error, covariance, line(run, result))


def three_sigma_of(
    name: str, t: FloatArray, error: FloatArray, covariance: FloatArray, style: Mapping[str, Any]
) -> Figure:
    """Errors (n, 6) in the body frame at t (n,), s, between three sigmas of their covariances (n, 6, 6)."""
    scale = np.repeat([1.0, np.rad2deg(1.0)], 3)
    with np.errstate(invalid="ignore"):
        sigma = scale * np.sqrt(np.einsum("tii->ti", covariance))
    figure = Figure(figsize=(8.0, 5.4))
    panels = figure.subplots(3, 2, sharex=True)
    handles: list[Any] = []
    for i, axis in enumerate(AXES):
        panel = panels[i % 3, i // 3]
        e, s = scale[i] * error[:, i], sigma[:, i]
        band = panel.fill_between(t, -3.0 * s, 3.0 * s, color="#d9e2ec", linewidth=0, label="three sigmas")
        drawn = panel.plot(t, e, **{**style, "linewidth": 1.0, "label": "error"})
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


def _ratio(run: Run, part: str) -> dict[str, FloatArray]:
    tables = {r.name: r.evidence.sigma_ratio for r in run.answered}
    return {name: table[part].to_numpy() for name, table in tables.items() if table is not None}


def _expected(panel: Axes, name: str, run: Run) -> list[Any]:
    """What a consistent estimator shows."""
    if name == "NEES of difference":
        low, high = (float(limit) for limit in chi_square_bounds(6.0))
        panel.axhline(6.0, **MIDDLE)
    elif name == "NIS per row":
        counts = [r.estimate.innovations.degrees for r in run.answered if r.estimate.innovations is not None]
        seen = np.concatenate(counts)
        if not seen.any():
            return []
        rows = float(np.median(seen[seen > 0]))
        low, high = (float(limit) / rows for limit in chi_square_bounds(rows))
        panel.axhline(1.0, **MIDDLE)
    else:
        panel.axhline(1.0, **MIDDLE)
        return []
    bottom, top = panel.get_ylim()
    panel.set_ylim(min(bottom, 0.7 * low), max(top, 1.4 * high))
    return [panel.axhspan(low, high, **BAND, label="95 % of the frames of a consistent filter")]


def _reach(error: FloatArray, sigma: FloatArray) -> float:
    """How far a panel reaches: over nearly all of the error, and the band as far as that leaves it visible."""
    e = np.abs(error[np.isfinite(error)])
    s = 3.0 * sigma[np.isfinite(sigma)]
    most = float(np.percentile(e, 99)) if len(e) else 0.0
    band = float(np.percentile(s, 98)) if len(s) else 0.0
    return 1.15 * max(most, min(band, 30.0 * most), 1e-9)
