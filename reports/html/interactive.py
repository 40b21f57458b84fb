"""Script, security policy and line styles of the pages whose paths and charts are interactive."""

from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from hashlib import sha256

import numpy as np
from markupsafe import Markup

from ..figures.style import DASHES, on_dark
from .templates import NO_SCRIPT, asset

SCRIPTS = ("data.js", "drawing.js", "chart.js", "path.js", "frame.js", "page.js")
"""a page's script in the order of its dependencies"""


@cache
def script() -> Markup:
    """The page's own script, as it stands between its tags."""
    text = "\n".join(asset(f"browser/{name}") for name in SCRIPTS)
    return Markup(f'\n"use strict";\n(() => {{\n{text}}})();\n')  # nosec: it is our own


def policy() -> Markup:
    """Content security policy: embedded pictures and styles, this very script, and nothing from anywhere."""
    digest = b64encode(sha256(script().encode("utf-8")).digest()).decode("ascii")
    return Markup(f"{NO_SCRIPT}; script-src 'sha256-{digest}'")  # nosec: it is our own


def line_rules(colors: Mapping[str, str]) -> Markup:
    """`.estimator-KEY` sets `--estimator`, `--dash` and the `--sample` of a legend by the color of its line."""
    rules = "\n".join(f".estimator-{key} {{ {_line_style(color)} }}" for key, color in colors.items())
    dark = "\n".join(f".estimator-{key} {{ --estimator: {on_dark(color)}; }}" for key, color in colors.items())
    return Markup(f"{rules}\n@media screen and (prefers-color-scheme: dark) {{\n{dark}\n}}")


def _line_style(color: str) -> str:
    lengths = DASHES.get(color, ())
    if not lengths:
        return f"--estimator: {color}; --dash: none; --sample: linear-gradient(var(--estimator) 0 0);"
    ends = np.cumsum(lengths)
    stops = [
        f"{'transparent' if i % 2 else 'var(--estimator)'} {end - length:g}px {end:g}px"
        for i, (length, end) in enumerate(zip(lengths, ends.tolist(), strict=True))
    ]
    dash = " ".join(f"{length:g}" for length in lengths)
    return f"--estimator: {color}; --dash: {dash}; --sample: repeating-linear-gradient(90deg, {', '.join(stops)});"
