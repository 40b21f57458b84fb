"""Figures as bytes and as files: the same run gives the same bytes."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from .layout import held
from .style import DPI, in_style

UNDATED: Mapping[str, Mapping[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""metadata without the time of writing"""
COMPRESSION = 3
"""of a PNG; zlib's default makes files 7 % smaller in 1.4 times the time"""
_written: WeakKeyDictionary[Figure, dict[str, bytes]] = WeakKeyDictionary()


@dataclass(frozen=True, slots=True)
class Written:
    """A figure of which only what was written is left."""

    title: str
    size: tuple[float, float]
    """inches"""
    files: Mapping[str, bytes]
    """by form"""


def written(figure: Figure, forms: Iterable[str]) -> Written:
    """What is left of a figure once it was written in these forms."""
    width, height = (float(side) for side in figure.get_size_inches())
    return Written(str(figure.get_label()), (width, height), {form: encoded(figure, form) for form in forms})


def save(figures: Mapping[str, Figure | Written], folder: Path, forms: Iterable[str] = ("png", "svg")) -> None:
    """Writes NAME.png (150 dpi), NAME.svg or what other forms are asked for of each figure into an existing folder."""
    chosen = tuple(forms)
    for name, figure in figures.items():
        stem = re.sub(r"[^\w.-]", "_", name)
        for form in chosen:
            (folder / f"{stem}.{form}").write_bytes(encoded(figure, form))


def encoded(figure: Figure | Written, form: str) -> bytes:
    """The figure as a file of the form `png`, `svg` or `pdf`; written once, remembered as long as the figure lives."""
    if isinstance(figure, Written):
        return figure.files[form]
    forms = _written.setdefault(figure, {})
    if form not in forms:
        with in_style(), held():
            forms[form] = _png(figure) if form == "png" else _saved(figure, form, metadata=UNDATED[form])
    return forms[form]


def _png(figure: Figure) -> bytes:
    """Without an alpha channel, since the ground is white: three quarters of the time."""
    canvas = FigureCanvasAgg(figure)
    figure.dpi = DPI
    canvas.draw()
    colors = np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, :3])  # as many rows and columns as it has
    stream = BytesIO()
    Image.fromarray(colors).save(stream, "png", compress_level=COMPRESSION, dpi=(DPI, DPI))
    return stream.getvalue()


def _saved(figure: Figure, form: str, **options: Any) -> bytes:
    stream = BytesIO()
    figure.savefig(stream, format=form, dpi=DPI, **options)
    return stream.getvalue()
