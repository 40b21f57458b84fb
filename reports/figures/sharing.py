"""The figures of a run, drawn by several processes at once."""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fgbaseline.data.parallel import shared
from fgbaseline.reports.comparison import Run

from .drawing import drawings
from .layout import lay_out
from .saving import Written, written
from .style import in_style

FORMS = ("png", "svg")


@contextmanager
def being_drawn(run: Run, processes: int) -> Iterator[Callable[[], dict[str, Written]]]:
    """Begins to draw, in other processes; what it gives waits for what `draw` draws, by name, written as PNG and SVG.

    The same bytes however many processes share the work. The figures over time, which take longest, are the last and
    come first.
    """
    names = list(drawings(run))
    with shared(lambda number: _one(run, names[number]), len(names), processes) as gathered:
        yield lambda: {name: one for name, one in zip(names, gathered(), strict=True) if one is not None}


def draw_and_write(run: Run, processes: int = 1) -> dict[str, Written]:
    """The same, with nothing else to do meanwhile."""
    with being_drawn(run, processes) as drawn:
        return drawn()


def _one(run: Run, name: str) -> Written | None:
    with _not_collecting(), in_style():
        figure = drawings(run)[name]()
        if figure is None:
            return None
        lay_out(figure)
        return written(figure, FORMS)


@contextmanager
def _not_collecting() -> Iterator[None]:
    """Without the search for cyclic garbage, a seventh of the time; that garbage is 13 MB for seven estimators."""
    collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collected:
            gc.enable()
