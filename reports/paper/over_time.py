"""What changes from frame to frame."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from fgbaseline.compare import chi_square_bounds
from fgbaseline.geometry import FloatArray

from ..figures.frames import fit_log, fit_log_or_linear
from .folder import Drawn
from .style import legend, line, panels

BAND: Mapping[str, Any] = {"color": "#d7e8d9", "zorder": 1, "linewidth": 0}
POSE_DEGREES = 6.0


@dataclass(frozen=True, slots=True)
class Panel:
    """A quantity of `series/NAME.csv`."""

    label: str
    column: str
    height: float = 0.95
    log: bool | None = None
    """None: where the estimators differ by decades"""
    expected: Callable[[pd.DataFrame], tuple[float, float, float]] | None = None
    """low, middle and high of the band in which 95 % of the frames of a consistent estimator lie"""


def divergence(run: Drawn) -> Figure | None:
    """Distance and angle from the reference."""
    wanted = [
        Panel("distance, m", "divergence_position"),
        Panel("angle, °", "divergence_rotation_deg"),
    ]
    return _figure(run, wanted, without=run.reference)


def error_to_truth(run: Drawn) -> Figure | None:
    """Distance and angle from the truth, without any alignment."""
    return _figure(run, [Panel("error, m", "truth_position"), Panel("error, °", "truth_rotation_deg")])


def reprojection(run: Drawn) -> Figure | None:
    """The median of each frame."""
    return _figure(run, [Panel("median error, px", "reprojection_median", 1.2, log=True)])


def consistency(run: Drawn) -> Figure | None:
    """NEES against truth and reference, NIS per row, and sigmas over the reference's."""
    wanted = [
        Panel("NEES", "nees", log=True, expected=lambda _: _band(POSE_DEGREES)),
        Panel("NEES of diff.", "nees_reference", log=True, expected=lambda _: _band(POSE_DEGREES)),
        Panel("NIS per row", "nis_per_row", log=True, expected=_nis_band),
        Panel("sigma ratio", "sigma_ratio_position", log=True),
    ]
    return _figure(run, wanted)


def time_per_frame(run: Drawn) -> Figure | None:
    """Seconds that each frame took."""
    return _figure(run, [Panel("time per frame, s", "seconds", 1.2, log=True)])


def _figure(run: Drawn, wanted: list[Panel], without: str | None = None) -> Figure | None:
    """The panels that have something to show; None where none has."""
    tables = {name: _with_nis(table) for name, table in run.series.items() if name != without}
    shown = [(panel, lines) for panel in wanted if (lines := _lines(tables, panel.column))]
    if not shown:
        return None
    figure, axes = panels([panel.height for panel, _ in shown])
    for on, (panel, lines) in zip(axes, shown, strict=True):
        for name, values in lines.items():
            on.plot(tables[name]["seconds_since_start"], values, **line(run, name, len(values)))
        if panel.log:
            fit_log(on, lines, decades=5.0)
        else:
            fit_log_or_linear(on, lines)
        if panel.expected is not None:
            _draw_band(on, *panel.expected(tables[next(iter(lines))]))
        if on.get_yscale() == "log":
            _few_ticks(on)
        on.set_ylabel(panel.label)
    axes[-1].set_xlabel("time, s")
    legend(figure, max(axes, key=lambda on: len(on.get_legend_handles_labels()[0])))
    return figure


def _lines(tables: Mapping[str, pd.DataFrame], column: str) -> dict[str, FloatArray]:
    values = {n: t[column].to_numpy(dtype=np.float64) for n, t in tables.items() if column in t}
    return {name: line for name, line in values.items() if (np.isfinite(line) & (line != 0.0)).any()}


def _with_nis(table: pd.DataFrame) -> pd.DataFrame:
    if "nis" not in table:
        return table
    return table.assign(nis_per_row=table["nis"] / table["nis_degrees"].where(table["nis_degrees"] > 0))


def _band(degrees: float) -> tuple[float, float, float]:
    low, high = chi_square_bounds(degrees)
    return float(low), degrees, float(high)


def _nis_band(table: pd.DataFrame) -> tuple[float, float, float]:
    rows = float(table["nis_degrees"].where(table["nis_degrees"] > 0).median())
    low, middle, high = _band(rows)
    return low / rows, middle / rows, high / rows


def _draw_band(axes: Axes, low: float, middle: float, high: float) -> None:
    bottom, top = axes.get_ylim()
    axes.set_ylim(min(bottom, 0.7 * low), max(top, 1.4 * high))
    axes.axhspan(low, high, label="95 % if consistent", **BAND)
    axes.axhline(middle, color="#6b9a72", linewidth=0.6, zorder=1.5)


def _few_ticks(axes: Axes) -> None:
    """Plain numbers at 1, 2 and 5 where there are fewer than two decades, and never more than a panel has room for."""
    low, high = axes.get_ylim()
    if high < 100.0 * low:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 30.0 * low else (1.0, 3.0), numticks=6))
        axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
