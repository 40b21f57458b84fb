"""The figures of a bench, in the look of a run's."""

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from fgbaseline import compare
from fgbaseline.data.plural import plural
from fgbaseline.geometry import FloatArray

from ..figures.health import NEES_BOUNDS
from ..figures.layout import lay_out
from ..figures.lettering import plain
from ..figures.palette import colours_of
from ..figures.style import LETTERS_IN_A_ROW, head, in_style, sheet, swatch
from ..results.bench import Results
from ..tables.bench_statistics import cases, costs, judge, records

MARKS = "osD^vP*Xh<>p"
MOST_CASES = 12
"""that a figure has room for"""
POSE_DEGREES = 6.0
FEW_DECADES = 100.0
FEW_SIZES = 3.0
"""times, by which sizes have to differ before a power of them says something"""


def draw(results: Results) -> dict[str, Figure]:
    """The figures by name; those for which there is nothing to show are missing."""
    drawn: dict[str, Figure] = {}
    with in_style():
        figures: tuple[Callable[[Results], Figure | None], ...] = (accuracy, accuracy_against_time, scaling)
        for one in figures:
            if (figure := one(results)) is not None:
                drawn[one.__name__] = figure
        for number, case in enumerate(results.cases, 1):
            if len(drawn) < MOST_CASES and (figure := nees_over_time(results, case)) is not None:
                drawn[f"nees_{number}"] = figure
        for figure in drawn.values():
            lay_out(figure)
    return drawn


def accuracy(results: Results) -> Figure | None:
    """Mean error of every estimator in every case, with its interval."""
    metric = judge(results)
    if metric is None:
        return None
    table = cases(results)
    names = [case for case in results.cases if table[table["case"] == case][metric.name].notna().any()][:MOST_CASES]
    rows = len(names) * (len(results.estimators) + 1)
    figure, (axes,) = sheet(1.2 + 0.17 * max(rows, 8))
    colours = _colours(results)
    places: dict[str, list[float]] = {}
    for group, case in enumerate(names):
        of_case = {row["estimator"]: row for row in records(table[table["case"] == case])}
        for place, name in enumerate(results.estimators):
            y = group * (len(results.estimators) + 1) + place
            places.setdefault(case, []).append(y)
            if name in of_case:
                _dot(axes, of_case[name], metric.name, y, colours[name])
    axes.set_yticks([float(np.mean(places[case])) for case in names], [plain(case) for case in names])
    axes.set_ylim(rows - 0.5, -1.0)
    axes.grid(visible=False, axis="y")
    _logarithmic(axes, "x")
    axes.set_xlabel(metric.heading)
    head(figure, "Accuracy, with 95 % intervals over seeds", _legend(results))
    return figure


def _dot(axes: Axes, row: Mapping[str, Any], metric: str, y: float, colour: str) -> None:
    axes.plot(row[metric], y, "o", color=colour, markersize=4.5)
    low, high = row.get(f"{metric}_low", np.nan), row.get(f"{metric}_high", np.nan)
    if np.isfinite(low):
        axes.plot([max(low, 0.02 * row[metric]), high], [y, y], color=colour, linewidth=1.4)


def accuracy_against_time(results: Results) -> Figure | None:
    """What accuracy costs: one mark for each estimator and case."""
    metric = judge(results)
    spent = costs(results)
    if metric is None or spent.empty:
        return None
    table = cases(results).merge(spent, on=["case", "estimator"])
    table = table[table[metric.name] > 0.0]
    if table.empty:
        return None
    figure, (axes,) = sheet(4.6)
    colours, marks = _colours(results), _marks(results)
    for row in records(table):
        axes.plot(
            row["ms_per_frame"],
            row[metric.name],
            marker=marks[row["case"]],
            color=colours[row["estimator"]],
            linestyle="none",
            markersize=6.5,
            markeredgecolor="white",
            markeredgewidth=0.5,
        )
    _logarithmic(axes, "x")
    _logarithmic(axes, "y")
    axes.set_xlabel("time per frame, ms")
    axes.set_ylabel(metric.heading)
    head(figure, "Accuracy against time: lower left is better", _legend(results))
    _case_legend(figure, results)
    return figure


def scaling(results: Results) -> Figure | None:
    """Time and memory by how many observations a run had; None where all had about as many."""
    spent = results.costs[results.costs["observations"] > 0]
    if spent.empty or spent["observations"].max() < 1.5 * spent["observations"].min():
        return None
    panels = {"seconds": "time, s"} | ({"memory_mb": "peak memory, MB"} if spent["memory_mb"].notna().any() else {})
    figure, axes = sheet(2.4 + 2.2 * len(panels), rows=len(panels))
    handles = []
    for name, colour in _colours(results).items():
        own = spent[spent["estimator"] == name]
        n, seconds = (own[column].to_numpy(dtype=np.float64) for column in ("observations", "seconds"))
        power = _power(n, seconds)
        handles.append(swatch(colour, plain(name) + (f": n to the {power[0]:.2g}" if power else "")))
        if power:
            ends = np.array([n.min(), n.max()])
            axes[0].plot(ends, power[1] * ends ** power[0], color=colour, linewidth=1.0, linestyle=(0, (4, 2)))
        for axis, column in zip(axes, panels, strict=True):
            axis.plot(n, own[column], "o", color=colour, markersize=4.0, alpha=0.75)
    for axis, title in zip(axes, panels.values(), strict=True):
        axis.set_ylabel(title)
        _logarithmic(axis, "x")
    _logarithmic(axes[0], "y")
    axes[-1].set_xlabel("observations of the run")
    head(figure, "How cost grows with the number of observations n", handles)
    return figure


def _power(n: FloatArray, seconds: FloatArray) -> tuple[float, float] | None:
    """Exponent and factor of seconds = factor n^exponent by least squares; None where sizes differ too little."""
    if len(np.unique(n)) < 3 or n.max() < FEW_SIZES * n.min() or not (seconds > 0.0).all():
        return None
    exponent, log_factor = np.polyfit(np.log(n), np.log(seconds), 1)
    return float(exponent), float(np.exp(log_factor))


def nees_over_time(results: Results, case: str) -> Figure | None:
    """ANEES over the runs of a case, frame by frame, with chi-square bounds; None for a single run."""
    columns = {name: results.nees[case, name] for name in results.estimators if (case, name) in results.nees}
    runs = max((len(values) for values in columns.values()), default=0)
    if runs < 2:
        return None
    figure, (axes,) = sheet(3.9)
    colours, handles, values = _colours(results), [], []
    for name, own in columns.items():
        table = compare.nees_over_runs(own)
        handles += axes.plot(table.index, table["anees"], color=colours[name], linewidth=1.2, label=plain(name))
        values.append(table["anees"].to_numpy(dtype=np.float64))
        if len(own) == runs:
            bounds = table[["low", "high"]]
    axes.set_yscale("log")
    axes.set_ylim(*_reach(values))
    band = axes.fill_between(bounds.index, bounds["low"], bounds["high"], color="#d7e8d9", zorder=1, linewidth=0)
    band.set_label(f"95 % bounds ({plural(runs, 'run')})")
    axes.axhline(POSE_DEGREES, color="#6b9a72", linewidth=0.9, zorder=1.5)
    axes.set_xlabel("frame")
    axes.set_ylabel("ANEES (above: overconfident)")
    head(figure, f"NEES over time, mean of {plural(runs, 'run')}: {plain(case)}", [*handles, band])
    return figure


def _reach(values: list[FloatArray]) -> tuple[float, float]:
    every = np.concatenate(values)
    every = every[np.isfinite(every) & (every > 0.0)]
    low, high = np.percentile(every, [1.0, 99.5]) if len(every) else NEES_BOUNDS
    return max(min(float(low), NEES_BOUNDS[0]) * 0.7, 1e-3), max(float(high), NEES_BOUNDS[1]) * 1.4


def _colours(results: Results) -> dict[str, str]:
    return colours_of(results.estimators, results.reference)


def _marks(results: Results) -> dict[str, str]:
    return {case: MARKS[index % len(MARKS)] for index, case in enumerate(results.cases)}


def _legend(results: Results) -> list[Any]:
    return [swatch(colour, plain(name)) for name, colour in _colours(results).items()]


def _case_legend(figure: Figure, results: Results) -> None:
    """Which mark is which case, below the panel."""
    if not 1 < len(results.cases) <= MOST_CASES:
        return
    names = {plain(case): mark for case, mark in _marks(results).items()}
    marks = [
        Line2D([], [], color="#555555", marker=mark, linestyle="none", markersize=6, label=name)
        for name, mark in names.items()
    ]
    columns = max(1, LETTERS_IN_A_ROW // (max(map(len, names)) + 6))
    figure.legend(handles=marks, loc="outside lower left", ncols=columns, alignment="left")


def _logarithmic(axes: Axes, which: Literal["x", "y"]) -> None:
    """With plain numbers, of which there are enough when the axis has less than two decades."""
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_formatter(FuncFormatter(_plain_number))
    low, high = axis.get_view_interval()
    few = low > 0.0 and high / low < FEW_DECADES
    axis.set_minor_locator(LogLocator(subs=(2.0, 5.0) if few else (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)))
    axis.set_minor_formatter(FuncFormatter(_plain_number) if few else NullFormatter())


def _plain_number(value: float, _: int | None = None) -> str:
    return f"{value:g}"
