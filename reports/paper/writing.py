"""Figures and their captions as files: the same folder gives the same bytes."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure

from ..figures.layout import held
from .style import in_style

FORMATS: Final = ("pdf", "svg", "png")
"""what figures can be written as"""
CAPTIONS: Final = "captions.json"
DPI = 300
UNDATED: Mapping[str, Mapping[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}, "png": {}}


def write(figures: Mapping[str, tuple[Figure, str]], folder: Path, formats: Iterable[str] = FORMATS) -> None:
    """NAME.FORMAT for each figure and format, and captions.json, into an existing folder."""
    with in_style(), held():
        for name, (figure, _) in figures.items():
            for form in formats:
                figure.savefig(folder / f"{name}.{form}", dpi=DPI, metadata=dict(UNDATED[form]))
    captions = {name: caption for name, (_, caption) in figures.items()}
    (folder / CAPTIONS).write_text(json.dumps(captions, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
