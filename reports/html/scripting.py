"""The page's own script: its pieces joined into one, and the policy that lets nothing else run."""

from base64 import b64encode
from functools import cache
from hashlib import sha256
from importlib.resources import files

from markupsafe import Markup

PIECES = ("data.js", "state.js", "drawing.js", "chart.js", "path.js", "frame.js", "page.js")
"""in the order in which they lean on one another"""


@cache
def script() -> Markup:
    """The script as it stands between its tags."""
    folder = files("fgbaseline.reports.html").joinpath("browser")
    text = "\n".join(folder.joinpath(name).read_text(encoding="utf-8") for name in PIECES)
    return Markup(f'\n"use strict";\n(() => {{\n{text}}})();\n')  # nosec: it is our own


def policy() -> str:
    """Content security policy: pictures and styles that are inside, this very script, and nothing from anywhere."""
    digest = b64encode(sha256(script().encode("utf-8")).digest()).decode("ascii")
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
