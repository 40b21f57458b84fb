"""Script, security policy and line styles of the pages whose paths and charts are interactive."""

from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from importlib.resources import files

import numpy as np
from markupsafe import Markup

from ..figures.style import DASHES, on_dark

SCRIPTS = ("data.js", "drawing.js", "chart.js", "path.js", "frame.js", "page.js")
"""a page's script in the order of its dependencies"""


@cache
def script() -> Markup:
    """The page's own script, as it stands between its tags."""
    folder = files("fgbaseline.reports.html").joinpath("browser")
    text = "\n".join(folder.joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS)
    return Markup(f'\n"use strict";\n(() => {{\n{text}}})();\n')  # nosec: it is our own


def policy() -> Markup:
    """Content security policy: embedded pictures and styles, this very script, and nothing from anywhere."""
    digest = b64encode(sha256(script().encode("utf-8")).digest()).decode("ascii")
    allowed = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    return Markup(allowed)  # nosec: it is our own


def line_rules(chosen: Mapping[str, str], keys: Mapping[str, str]) -> Markup:
    """`.estimator-KEY` sets `--estimator` and `--dash` of a name's line by its color, and `--sample` of a legend."""
    rules = "\n".join(f".estimator-{keys[name]} {{ {_line_style(color)} }}" for name, color in chosen.items())
    dark = "\n".join(f".estimator-{keys[name]} {{ --estimator: {on_dark(color)}; }}" for name, color in chosen.items())
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
