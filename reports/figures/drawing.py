"""Figures drawn and encoded in the background, by forks of this process."""

import gc
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from matplotlib.figure import Figure

from fgbaseline.data.parallel import background_map

from .layout import lay_out
from .saving import EncodedFigure, encode_figure
from .style import in_style

FORMS = ("png", "svg")
SHARES = 256
"""largest number of shares of the work: as many as `background_map` takes"""
DrawOne = Callable[[], Figure | None]
"""draws a figure, within `in_style()` and without layout; None where there is nothing to show"""


@contextmanager
def encoded_in_background(
    figures: Mapping[str, DrawOne], processes: int
) -> Iterator[Callable[[], dict[str, EncodedFigure]]]:
    """Begins to draw, in other processes; what it gives waits for the figures by name, encoded as PNG and SVG.

    The bytes are the same however many processes share the work. The last figures come first: let them be those that
    take longest.
    """
    names = list(figures)
    shares = min(len(names), SHARES)
    with background_map(lambda i: [_encoded(figures[name]) for name in names[i::shares]], shares, processes) as joined:

        def gathered() -> dict[str, EncodedFigure]:
            shared = joined()
            every = {name: shared[k % shares][k // shares] for k, name in enumerate(names)}
            return {name: one for name, one in every.items() if one is not None}

        yield gathered


def _encoded(draw_one: DrawOne) -> EncodedFigure | None:
    with without_garbage_collection(), in_style():
        figure = draw_one()
        if figure is None:
            return None
        lay_out(figure)
        return encode_figure(figure, FORMS)


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """Without the search for cyclic garbage, a seventh of the time; that garbage is 13 MB for seven estimators."""
    collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collected:
            gc.enable()
