"""Figures of a result, drawn and laid out at once, or in the background by forks of this process, and their files.

The same data give the same bytes.
"""

import gc
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, Final
from weakref import WeakKeyDictionary

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from PIL import Image

from fgbaseline.data.parallel import background_map

from .layout import lay_out, without_layout_engine
from .style import PAPER, SCREEN, Style, in_style

FORMS = ("png", "svg")
SHARES = 256
"""largest number of shares of the work: as many as `background_map` takes"""
CAPTIONS: Final = "captions.json"
UNDATED: Mapping[str, Mapping[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""metadata without the time of writing"""
COMPRESSION = 3
"""compression level of a PNG; zlib's default makes files 7 % smaller in 1.4 times the time"""
DrawOne = Callable[[], Figure | None]
"""draws a figure, within `in_style()` and without layout; None where there is nothing to show"""
Captioned = Mapping[str, tuple[Callable[..., Figure | None], str]]
"""name -> figure from the data of a result and a style, which may be None, and its caption in a paper"""
_written: WeakKeyDictionary[Figure, dict[str, bytes]] = WeakKeyDictionary()

# An open font file has one position for all processes that inherit it: a fork that reads it moves it under its parent
# ("invalid outline", or another glyph). In a fork Matplotlib drops the fonts of its own cache, but not those of parsed
# mathematics (3.11).
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=MathTextParser._parse_cached.cache_clear)  # type: ignore[attr-defined]


@dataclass(frozen=True, slots=True)
class EncodedFigure:
    """Figure in its file formats, without its matplotlib objects."""

    title: str
    size: tuple[float, float]
    """inches"""
    files: Mapping[str, bytes]
    """by form"""


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
    with background_map(lambda i: [_drawn_files(figures[n]) for n in names[i::shares]], shares, processes) as joined:

        def gathered() -> dict[str, EncodedFigure]:
            shared = joined()
            every = {name: shared[k % shares][k // shares] for k, name in enumerate(names)}
            return {name: one for name, one in every.items() if one is not None}

        yield gathered


def _drawn_files(draw_one: DrawOne) -> EncodedFigure | None:
    """Figure as bytes, drawn without the search for cyclic garbage.

    That search takes a seventh of the time; the garbage is 13 MB for seven estimators.
    """
    collected = gc.isenabled()
    gc.disable()
    try:
        figure = drawn({"": draw_one}).get("")
        if figure is None:
            return None
        width, height = (float(side) for side in figure.get_size_inches())
        return EncodedFigure(str(figure.get_label()), (width, height), {form: encoded(figure, form) for form in FORMS})
    finally:
        if collected:
            gc.enable()


def save(
    figures: Mapping[str, Figure | EncodedFigure], folder: Path, forms: Sequence[str] = FORMS, style: Style = SCREEN
) -> None:
    """Writes NAME.FORM of each figure and form (`png`, `svg`, `pdf`) into an existing folder."""
    for name, figure in figures.items():
        stem = re.sub(r"[^\w.-]", "_", name)
        for form in forms:
            (folder / f"{stem}.{form}").write_bytes(encoded(figure, form, style))


def save_captions(captions: Mapping[str, str], folder: Path) -> None:
    """Writes captions.json into an existing folder."""
    (folder / CAPTIONS).write_text(json.dumps(captions, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def encoded(figure: Figure | EncodedFigure, form: str, style: Style = SCREEN) -> bytes:
    """File of a figure in the form `png`, `svg` or `pdf`; written once, remembered as long as the figure lives."""
    if isinstance(figure, EncodedFigure):
        return figure.files[form]
    forms = _written.setdefault(figure, {})
    if form not in forms:
        with in_style(style), without_layout_engine():
            forms[form] = _png(figure, style.dpi) if form == "png" else _vectors(figure, form, style.dpi)
    return forms[form]


def _vectors(figure: Figure, form: str, dpi: int) -> bytes:
    stream = StringIO() if form == "svg" else BytesIO()  # SVG into bytes would encode thousands of strings one by one
    figure.savefig(stream, format=form, dpi=dpi, metadata=UNDATED[form])
    content = stream.getvalue()
    return content.encode("utf-8") if isinstance(content, str) else content


def _png(figure: Figure, dpi: int) -> bytes:
    """PNG without an alpha channel, since the ground is white: three quarters of the time."""
    figure.dpi = dpi
    canvas = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else FigureCanvasAgg(figure)
    canvas.draw()
    drawn = canvas.buffer_rgba()
    image = Image.frombuffer("RGBA", (drawn.shape[1], drawn.shape[0]), drawn, "raw", "RGBA", 0, 1).convert("RGB")
    stream = BytesIO()
    image.save(stream, "png", compress_level=COMPRESSION, dpi=(dpi, dpi))
    return stream.getvalue()
