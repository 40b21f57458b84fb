"""Legends: every line of a figure has an entry, inside the sheet, however many estimators there are."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.reports import figures
from fgbaseline.reports.figures.layout import title_and_legend
from fgbaseline.reports.figures.run import draw_for_paper
from fgbaseline.reports.figures.run_data import of_folder
from fgbaseline.reports.figures.style import PAPER, SCREEN, in_style, label
from fgbaseline.reports.run.folder import write_numbers

from ..builders.runs import answer, run_of, scene
from ..builders.synthetic import plain_problem

NAMES = (
    "dead-reckoning",
    "ekf",
    "joint-ekf",
    "joint-ekf-first-estimate",
    "fixed-lag",
    "isam2",
    "isam2-online",
    "batch",
    "my-filter",
    "a-filter-with-a-long-name",
)


@cache
def ten() -> Run:
    problem = plain_problem(scene())
    answers = [
        answer(problem, name, (0.3 * i, 0.1 * i, 0.0), seconds=np.full(problem.n_frames, 1e-3 * (1 + i)))
        for i, name in enumerate(NAMES)
    ]
    return run_of(problem, *answers)


@cache
def drawn_ten() -> dict[str, Figure]:
    return figures.draw(ten())


def test_a_title_wider_than_the_sheet_has_several_lines() -> None:
    names = ", ".join(f"{name} 0.285 m" for name in NAMES)
    title = f"Errors against MH_05_difficult, SE(3)-aligned (RMSE: {names})"
    with in_style():
        figure = Figure(figsize=(SCREEN.width, 3.0))
        lines = figure.subplots().plot([0.0, 1.0], label="ekf")
        title_and_legend(figure, title, lines)
        FigureCanvasAgg(figure).draw()
    assert figure.get_label() == title
    box = figure.legends[0].get_title().get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width
    assert figure.axes[0].bbox.height > 0.4 * figure.bbox.height


def assert_legend_is_whole(name: str, figure: Figure) -> None:
    """Every labeled line has its entry, or a panel of its own, and every entry lies on the sheet."""
    drawn = {str(line.get_label()) for axes in figure.axes for line in axes.get_lines()}
    FigureCanvasAgg(figure).draw()
    texts = [text for legend in figure.legends for text in legend.get_texts()]
    entries = {text.get_text() for text in texts}
    titles = figure.get_label() + "".join(axes.get_title(loc="left") for axes in figure.axes)
    for text in drawn - entries:
        assert text == "" or text.startswith("_") or text in titles, (name, text)
    for text in texts:
        box = text.get_window_extent()
        assert 0.0 <= box.x0 <= box.x1 <= figure.bbox.x1, (name, text.get_text())


def test_a_line_below_a_logarithmic_axis_is_named_above_the_panel() -> None:
    with in_style():
        figure = Figure(figsize=(SCREEN.width, 3.0))
        shown, cut = figure.subplots(1, 2)
        lines = [
            panel.plot([1.0, y], label=name) for panel in (shown, cut) for name, y in (("ekf", 2.0), ("batch", 1e-5))
        ]
        for panel in (shown, cut):
            panel.set_yscale("log")
        cut.get_lines()[1].set_ydata([1e-5, 1e-6])
        cut.set_ylim(0.1, 3.0)
        shown.set_ylim(0.1, 3.0)
        title_and_legend(figure, "Divergence", [line for each in lines for line in each])
    assert shown.get_title(loc="left") == ""
    assert cut.get_title(loc="left") == "below the axis: batch"


def test_on_the_screen() -> None:
    with in_style():
        for name, figure in drawn_ten().items():
            assert_legend_is_whole(name, figure)


def test_a_legend_has_the_estimators_in_the_order_of_the_run_and_short_entries() -> None:
    order = [label(name, "isam2") for name in NAMES]
    for name, figure in drawn_ten().items():
        entries = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
        names = [entry for entry in entries if entry in order]
        assert names == [entry for entry in order if entry in names], name
        assert max(map(len, entries), default=0) <= 32, name


def test_on_paper(tmp_path: Path) -> None:
    write_numbers(ten(), tmp_path)
    drawn = draw_for_paper(of_folder(tmp_path))
    paths = {text.get_text() for legend in drawn["paths"][0].legends for text in legend.get_texts()}
    assert paths >= {label(name, "isam2") for name in NAMES}
    with in_style(PAPER):
        for name, (figure, _) in drawn.items():
            assert_legend_is_whole(name, figure)


def test_estimators_with_the_same_map_of_the_image_are_side_by_side() -> None:
    figure = drawn_ten()["image_regions"]
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()]
    assert titles == [label(name, "isam2") for name in NAMES]
    table = ten().results["ekf"].evidence.patterns
    regions = table[table["by"] == "image region"].set_index("of")["median"]
    shown = figure.axes[1].images[0].get_array()
    assert shown is not None
    for row, vertical in enumerate(("top", "middle", "bottom")):
        for column, horizontal in enumerate(("left", "center", "right")):
            expected = regions.get(f"{vertical} {horizontal}")
            assert (shown[row, column] == pytest.approx(expected)) if expected is not None else shown.mask[row, column]
