"""Figures as bytes and as files: the same run gives the same bytes."""

import re
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from weakref import WeakKeyDictionary

from matplotlib.figure import Figure

from .style import in_style

DPI = 150
_written: WeakKeyDictionary[Figure, dict[str, bytes]] = WeakKeyDictionary()


def save(figures: Mapping[str, Figure], folder: Path) -> None:
    """Writes NAME.png (150 dpi) and NAME.svg for each figure into an existing folder."""
    for name, figure in figures.items():
        stem = re.sub(r"[^\w.-]", "_", name)
        (folder / f"{stem}.png").write_bytes(encoded(figure, "png"))
        (folder / f"{stem}.svg").write_bytes(encoded(figure, "svg"))


def encoded(figure: Figure, form: str) -> bytes:
    """The figure as a file of the form `png` or `svg`; written once, and remembered as long as the figure lives."""
    forms = _written.setdefault(figure, {})
    if form not in forms:
        stream = BytesIO()
        with in_style():
            figure.savefig(stream, format=form, dpi=DPI, metadata={"Date": None} if form == "svg" else {})
        forms[form] = stream.getvalue()
    return forms[form]
