"""Panels fill their figure: nothing is cut off, nothing overlaps, and constrained layout would place them alike."""

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from fgbaseline.reports.figures.layout import lay_out, title_and_legend
from fgbaseline.reports.figures.style import in_style, stacked_panels

AWAY = 0.02
"""of the figure's width or height, from where constrained layout has an edge of a panel"""


def rows_of_panels() -> Figure:
    figure, panels = stacked_panels(6.0, rows=3, height_ratios=[1.7, 1.0, 1.0])
    for panel, scale in zip(panels, (1e-3, 1.0, 1e3), strict=True):
        panel.plot([0.0, 50.0, 105.0], [scale, 40.0 * scale, 90.0 * scale], label=f"{scale:g}")
        panel.set_ylabel("error, m")
    panels[0].set_yscale("log")
    panels[-1].set_xlabel("time, s")
    title_and_legend(figure, "Rows", [line for panel in panels for line in panel.get_lines()])
    return figure


def square_of_panels() -> Figure:
    figure = Figure(figsize=(8.0, 5.8))
    for i, panel in enumerate(figure.subplots(2, 2).ravel()):
        panel.plot(np.geomspace(0.3, 200.0, 6), label="all" if i else "first")
        panel.set_xticks(range(6), [f"class {k}" for k in range(6)], rotation=30, ha="right")
        panel.set_title(f"panel {i}")
        panel.set_ylabel("px")
        panel.set_yscale("log")
    title_and_legend(figure, "Square", figure.axes[0].get_lines())
    return figure


def spanning_panels() -> Figure:
    figure = Figure(figsize=(8.0, 6.0))
    grid = figure.add_gridspec(3, 2, height_ratios=[1.0, 2.0, 1.0], width_ratios=[2.0, 1.0])
    for place in (grid[0, :], grid[1, 0], grid[1:, 1], grid[2, 0]):
        figure.add_subplot(place).plot([0.0, 1.0], [0.0, 1000.0])
    figure.axes[-1].set_visible(False)
    return figure


FIGURES = [rows_of_panels, square_of_panels, spanning_panels]


def everything_of(panel: Axes) -> Any:
    box = panel.get_tightbbox()
    assert box is not None
    return box


@pytest.mark.parametrize("make", FIGURES)
def test_everything_is_inside_the_figure_and_nothing_overlaps(make: Any) -> None:
    with in_style():
        figure = make()
        lay_out(figure)
        width, height = figure.bbox.size
        boxes = [everything_of(panel) for panel in figure.axes if panel.get_visible()]
        boxes += [legend.get_window_extent() for legend in figure.legends]
    assert all(box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height for box in boxes)
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


def test_ticks_that_change_with_the_size_of_a_panel_are_inside_too() -> None:
    # At its final height a panel may have ticks at halves where it had them at wholes, and needs room for them.
    with in_style():
        for low in np.linspace(2.0, 9.0, 25):
            figure, (panel,) = stacked_panels(3.4)
            panel.set_ylim(-low, 0.6)
            panel.set_ylabel("height, m")
            panel.set_xlabel("time, s")
            title_and_legend(figure, "Height", panel.plot([0.0, 60.0], [0.0, -low], label="path"))
            lay_out(figure)
            assert everything_of(panel).x0 >= 0.0, f"from {-low:.2f} m on"


@pytest.mark.parametrize("make", FIGURES)
def test_constrained_layout_would_place_them_alike(make: Any) -> None:
    with in_style():
        ours, theirs = make(), make()
        lay_out(ours)
        theirs.get_layout_engine().execute(theirs)
    for panel, other in zip(ours.axes, theirs.axes, strict=True):
        if panel.get_visible():
            assert np.allclose(panel.get_position().get_points(), other.get_position().get_points(), atol=AWAY)


def test_minor_ticks_without_labels_are_one_line_at_their_places() -> None:
    with in_style():
        figure = rows_of_panels()
        panel = figure.axes[0]
        low, high = panel.get_ylim()
        expected = [y for y in panel.yaxis.get_minorticklocs() if low <= y <= high]
        lay_out(figure)
    assert isinstance(panel.yaxis.get_minor_locator(), NullLocator)
    assert np.allclose(np.asarray(panel.get_lines()[-1].get_ydata()), expected)
