"""Figures that are written in no time: nine tenths of a run on a short recording are drawing them."""

from collections.abc import Callable
from functools import cache
from io import BytesIO
from typing import Any

import pytest
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from fgbaseline.reports.figures import comparison, drawing, layout, run
from fgbaseline.reports.figures.run import figure_functions
from fgbaseline.reports.figures.run_data import RunData


@cache
def empty_files() -> dict[str, bytes]:
    """An empty figure in each form; the first call imports what writes them."""
    empty = {}
    for form in ("png", "svg", "pdf"):
        stream = BytesIO()
        Figure(figsize=(0.1, 0.1)).savefig(stream, format=form)
        empty[form] = stream.getvalue()
    return empty


def figures_left_empty(patch: pytest.MonkeyPatch) -> None:
    """For tests of something else: tests/reports/test_figures.py looks at figures."""
    empty, written = empty_files(), Figure.savefig

    def savefig(figure: Figure, target: object, **options: Any) -> None:
        if isinstance(target, BytesIO):
            target.write(empty[options["format"]])
        else:
            written(figure, target, **options)  # type: ignore[arg-type]

    def blank(data: RunData) -> dict[str, Callable[[], Figure]]:
        return dict.fromkeys(figure_functions(data), Figure)

    patch.setattr(Figure, "savefig", savefig)
    patch.setattr(drawing, "_png", lambda *_: empty["png"])
    patch.setattr(layout, "fill_grid", lambda _: None)
    patch.setattr(ConstrainedLayoutEngine, "execute", lambda *_: None)
    patch.setattr(run, "figure_functions", blank)
    patch.setattr(drawing, "lay_out", lambda _: None)


def figures_left_out(patch: pytest.MonkeyPatch) -> None:
    """Runs and comparisons have no figures, which saves what even empty ones take."""
    patch.setattr(run, "figure_functions", lambda _: {})
    patch.setattr(comparison, "figure_functions", lambda _: {})
