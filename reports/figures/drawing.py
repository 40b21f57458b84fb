"""Figures of a result: drawn and laid out at once, or drawn and encoded in the background by forks of this process."""

import gc
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any

from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser

from fgbaseline.data.parallel import background_map

from .layout import lay_out
from .saving import EncodedFigure, encode_figure
from .style import PAPER, SCREEN, Style, in_style

FORMS = ("png", "svg")
SHARES = 256
"""largest number of shares of the work: as many as `background_map` takes"""
DrawOne = Callable[[], Figure | None]
"""draws a figure, within `in_style()` and without layout; None where there is nothing to show"""
Captioned = Mapping[str, tuple[Callable[..., Figure | None], str]]
"""name -> figure from the data of a result and a style, which may be None, and its caption in a paper"""

# An open font file has one position for all processes that inherit it: a fork that reads it moves it under its parent
# ("invalid outline", or another glyph). In a fork Matplotlib drops the fonts of its own cache, but not those of parsed
# mathematics (3.11).
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=MathTextParser._parse_cached.cache_clear)  # type: ignore[attr-defined]


def drawn(figures: Mapping[str, DrawOne], style: Style = SCREEN) -> dict[str, Figure]:
    """Figures by name, laid out; those for which there is nothing to show are missing."""
    with in_style(style):
        every = {name: draw_one() for name, draw_one in figures.items()}
        there = {name: figure for name, figure in every.items() if figure is not None}
        for figure in there.values():
            lay_out(figure)
    return there


def drawn_for_paper(data: Any, figures: Captioned, words: Mapping[str, str]) -> dict[str, tuple[Figure, str]]:
    """Figures of a result for a paper in two columns: name -> figure, and caption with the `words` in place."""
    there = drawn({name: partial(draw_one, data, PAPER) for name, (draw_one, _) in figures.items()}, PAPER)
    return {name: (figure, figures[name][1].format(**words)) for name, figure in there.items()}


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
    """Figure as bytes, drawn without the search for cyclic garbage.

    That search takes a seventh of the time; the garbage is 13 MB for seven estimators.
    """
    collected = gc.isenabled()
    gc.disable()
    try:
        figure = drawn({"": draw_one}).get("")
        return None if figure is None else encode_figure(figure, FORMS)
    finally:
        if collected:
            gc.enable()
