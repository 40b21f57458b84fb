"""Figures of a bench: accuracy by case and against time, cost by size, NEES over runs."""

from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from fgbaseline import compare
from fgbaseline.data.wording import plural
from fgbaseline.geometry import FloatArray

from .drawing import drawn
from .layout import title_and_legend
from .panels import DEGREES_OF_FREEDOM, chi_square_limits, intervals, swatch
from .style import BAND, GRAY, GREEN, SCREEN, safe_text, stacked_panels
from .style import colors as colors_of

if TYPE_CHECKING:
    from fgbaseline.reports.results.bench import Results
    from fgbaseline.reports.results.metric_record import Metric

MARKERS = "osD^vP*Xh<>p"
MOST_CASES = 12
"""number that a figure has room for"""
FEW_DECADES = 100.0
FEW_SIZES = 3.0
"""factor by which sizes have to differ for an exponent to be estimated"""


def draw(results: "Results", metric: "Metric | None", cases: pd.DataFrame, costs: pd.DataFrame) -> dict[str, Figure]:
    """Figures by name; those for which there is nothing to show are missing.

    `metric` is the one by which accuracy is judged (None: there is none), `cases` and `costs` are the tables by case
    and estimator.
    """
    figures = drawn(
        {
            "accuracy": lambda: None if metric is None else accuracy(results, metric, cases),
            "accuracy_against_time": lambda: None if metric is None else against_time(results, metric, cases, costs),
            "scaling": lambda: scaling(results),
        }
    )
    repeated = {f"nees_{n}": case for n, case in enumerate(results.cases, 1) if _runs(results, case) > 1}
    chosen = islice(repeated.items(), MOST_CASES - len(figures))
    return figures | drawn({name: partial(nees_over_time, results, case) for name, case in chosen})


def accuracy(results: "Results", metric: "Metric", cases: pd.DataFrame) -> Figure:
    """Mean error of every estimator in every case, with its interval."""
    key, group = metric.name, len(results.estimators) + 1
    names = [case for case in results.cases if cases[cases["case"] == case][key].notna().any()][:MOST_CASES]
    rows = len(names) * group
    figure, (axes,) = stacked_panels(1.2 + 0.17 * max(rows, 8))
    color = _colors(results)
    dots = []
    for row in cases[cases["case"].isin(names)].to_dict("records"):
        name, value, nan = row["estimator"], row[key], float("nan")
        low, high = row.get(f"{key}_low", nan), row.get(f"{key}_high", nan)
        y = names.index(row["case"]) * group + results.estimators.index(name)
        dots.append((float(y), max(low, 0.02 * value) if low == low else nan, value, high, color[name]))
    intervals(axes, dots, 4.5, 1.4, "projecting")
    middles = [i * group + 0.5 * (group - 2) for i in range(len(names))]
    axes.set_yticks(middles, [safe_text(case) for case in names])
    axes.set_ylim(rows - 0.5, -1.0)
    _logarithmic(axes, "x")
    axes.set_xlabel(metric.heading)
    title_and_legend(figure, "Accuracy, with 95 % intervals over seeds", _legend(results))
    return figure


def against_time(results: "Results", metric: "Metric", cases: pd.DataFrame, costs: pd.DataFrame) -> Figure | None:
    """Accuracy over time per frame: one mark for each estimator and case; None without costs."""
    if costs.empty:
        return None
    table = cases.merge(costs, on=["case", "estimator"])
    table = table[table[metric.name] > 0.0]
    if table.empty:
        return None
    figure, (axes,) = stacked_panels(4.6)
    color, marks = _colors(results), _marks(results)
    look: dict[str, Any] = {"markersize": 6.5, "markeredgecolor": "white", "markeredgewidth": 0.5}
    for row in table.to_dict("records"):
        mark = {"marker": marks[row["case"]], "color": color[row["estimator"]], "linestyle": "none", **look}
        axes.plot(row["ms_per_frame"], row[metric.name], **mark)
    _logarithmic(axes, "x")
    _logarithmic(axes, "y")
    axes.set(xlabel="time per frame, ms", ylabel=metric.heading)
    title_and_legend(figure, "Accuracy against time: lower left is better", _legend(results))
    _case_legend(figure, results)
    return figure


def scaling(results: "Results") -> Figure | None:
    """Time and memory by how many observations a run had; None where all had about as many."""
    spent = results.costs[results.costs["observations"] > 0]
    if spent.empty or spent["observations"].max() < 1.5 * spent["observations"].min():
        return None
    panels = {"seconds": "time, s"} | ({"memory_mb": "peak memory, MB"} if spent["memory_mb"].notna().any() else {})
    figure, axes = stacked_panels(2.4 + 2.2 * len(panels), rows=len(panels))
    handles = []
    for name, color in _colors(results).items():
        own = spent[spent["estimator"] == name]
        n, seconds = (own[column].to_numpy(dtype=np.float64) for column in ("observations", "seconds"))
        power = _power(n, seconds)
        handles.append(swatch(color, safe_text(name) + (f": n to the {power[0]:.2g}" if power else "")))
        if power:
            ends = np.array([n.min(), n.max()])
            axes[0].plot(ends, power[1] * ends ** power[0], color=color, linewidth=1.0, linestyle=(0, (4, 2)))
        for axis, column in zip(axes, panels, strict=True):
            axis.plot(n, own[column], "o", color=color, markersize=4.0, alpha=0.75)
    for axis, title in zip(axes, panels.values(), strict=True):
        axis.set_ylabel(title)
        _logarithmic(axis, "x")
    _logarithmic(axes[0], "y")
    axes[-1].set_xlabel("observations of the run")
    title_and_legend(figure, "How cost grows with the number of observations n", handles)
    return figure


def _power(n: FloatArray, seconds: FloatArray) -> tuple[float, float] | None:
    """Exponent and factor of seconds = factor n^exponent by least squares; None where sizes differ too little."""
    if len(np.unique(n)) < 3 or n.max() < FEW_SIZES * n.min() or not (seconds > 0.0).all():
        return None
    exponent, log_factor = np.polyfit(np.log(n), np.log(seconds), 1)
    return float(exponent), float(np.exp(log_factor))


def _runs(results: "Results", case: str) -> int:
    """Largest number of runs of a case whose NEES an estimator has."""
    return max((len(nees) for (of, _), nees in results.nees.items() if of == case), default=0)


def nees_over_time(results: "Results", case: str) -> Figure:
    """ANEES over the runs of a case, frame by frame, with chi-square bounds."""
    columns = {name: results.nees[case, name] for name in results.estimators if (case, name) in results.nees}
    runs = _runs(results, case)
    figure, (axes,) = stacked_panels(3.9)
    color, handles, values = _colors(results), [], []
    for name, own in columns.items():
        table = compare.average_nees(own)
        handles += axes.plot(table.index, table["anees"], color=color[name], linewidth=1.2, label=safe_text(name))
        values.append(table["anees"].to_numpy(dtype=np.float64))
        if len(own) == runs:
            bounds = table[["low", "high"]]
    axes.set(yscale="log", ylim=_reach(values), xlabel="frame", ylabel="ANEES (above: overconfident)")
    band = axes.fill_between(bounds.index, bounds["low"], bounds["high"], color=BAND, zorder=1, linewidth=0)
    band.set_label(f"95 % bounds ({plural(runs, 'run')})")
    axes.axhline(DEGREES_OF_FREEDOM, color=GREEN, linewidth=0.9, zorder=1.5)
    title_and_legend(figure, f"NEES over time, mean of {plural(runs, 'run')}: {safe_text(case)}", [*handles, band])
    return figure


def _reach(values: list[FloatArray]) -> tuple[float, float]:
    every = np.concatenate(values)
    every = every[np.isfinite(every) & (every > 0.0)]
    below, _, above = chi_square_limits(DEGREES_OF_FREEDOM)
    low, high = np.percentile(every, [1.0, 99.5]) if len(every) else (below, above)
    return max(min(float(low), below) * 0.7, 1e-3), max(float(high), above) * 1.4


def _colors(results: "Results") -> dict[str, str]:
    return colors_of(results.estimators, results.reference)


def _marks(results: "Results") -> dict[str, str]:
    return {case: MARKERS[index % len(MARKERS)] for index, case in enumerate(results.cases)}


def _legend(results: "Results") -> list[Any]:
    return [swatch(color, safe_text(name)) for name, color in _colors(results).items()]


def _case_legend(figure: Figure, results: "Results") -> None:
    """Legend of the marks of the cases, below the panel."""
    if not 1 < len(results.cases) <= MOST_CASES:
        return
    look: dict[str, Any] = {"color": GRAY, "linestyle": "none", "markersize": 6}
    marks = [Line2D([], [], marker=mark, label=safe_text(case), **look) for case, mark in _marks(results).items()]
    longest = max(len(str(mark.get_label())) for mark in marks)
    columns = max(1, SCREEN.letters // (longest + SCREEN.spare))
    figure.legend(handles=marks, loc="outside lower left", ncols=columns, alignment="left")


def _logarithmic(axes: Axes, which: Literal["x", "y"]) -> None:
    """Logarithmic axis with plain numbers, also where it has less than two decades."""
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_formatter("{x:g}")
    low, high = axis.get_view_interval()
    few = low > 0.0 and high / low < FEW_DECADES
    axis.set_minor_locator(LogLocator(subs=(2.0, 5.0) if few else (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)))
    axis.set_minor_formatter("{x:g}" if few else NullFormatter())
