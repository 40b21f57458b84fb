"""HTML of a page: one template for all kinds, script and security policy, and the styles of estimators' lines.

A page without plots has no script; none of them can load anything.
"""

import re
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from hashlib import sha256
from importlib.resources import files
from itertools import groupby
from typing import Any

import numpy as np
from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from ..figures.palette import DASHES, TRUTH, dark_matrix, on_dark
from ..formatting import unbroken
from ..phrases.evidence import FIRST
from ..results.glossary import TERMS, WORDS
from ..results.provenance import creation
from ..tables.table import Table
from .page import Block, Folded, Grid, Page
from .plot_encoding import TRUTH_LINE, embedded_json

NO_SCRIPT = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""content security policy of a page without a script"""
SCRIPTS = ("data.js", "drawing.js", "chart.js", "path.js", "path_controls.js", "frame.js", "page.js")
"""a page's script in the order of its dependencies"""


def render_page(page: Page) -> str:
    """HTML of a page: one file that needs no other and makes no request. All text that comes from files is escaped."""
    plots, keys = page.plots, {name: str(i) for i, name in enumerate(page.colors)}
    titles = {title: key for name, key in keys.items() for title in (name, f"{name} (reference)")}
    return (
        environment()
        .get_template("page.html")
        .render(
            page=page,
            most=FIRST,
            sections=[section for section in (page.table, *page.sections) if section.blocks],
            css=Markup(asset("report.css") + (asset("explore.css") if page.colors else "")),
            dark_matrix=" ".join(f"{value:g}" for row in dark_matrix() for value in (*row[:3], 0, row[3])),
            glossary={**TERMS, **WORDS},
            terms=_terms(page),
            line_rules=line_rules({**{keys[name]: color for name, color in page.colors.items()}, TRUTH_LINE: TRUTH}),
            classes={title: f"estimator-{key}" for title, key in titles.items()},
            policy=Markup(NO_SCRIPT) if plots is None else policy(),
            record={**page.settings, **creation()},
            **({} if plots is None else _interactive(plots)),
        )
    )


def environment() -> Environment:
    """Templates beside this module; everything is escaped, and an unknown name is an error."""
    jinja = Environment(
        loader=FunctionLoader(asset), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    jinja.filters |= {"flattened": flattened, "anchor": anchor, "unbroken": unbroken, "shape": _shape}
    return jinja


def asset(name: str) -> str:
    """A template, style sheet or script of this folder."""
    return files("fgbaseline.reports.html").joinpath(name).read_text(encoding="utf-8")


def _shape(block: Block) -> str:
    return type(block).__name__


def anchor(text: str) -> str:
    """Identifier of an element under a title."""
    return re.sub(r"\W+", "-", text).strip("-").lower()


def flattened(tree: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    """Leaves of nested settings as (dotted name, text)."""
    leaves: list[tuple[str, str]] = []
    for key, value in tree.items():
        if isinstance(value, Mapping):
            leaves += flattened(value, f"{above}{key}.")
        elif isinstance(value, list | tuple):
            leaves.append((f"{above}{key}", ", ".join(map(str, value))))
        else:
            leaves.append((f"{above}{key}", "–" if value is None else str(value)))
    return leaves


def _terms(page: Page) -> dict[str, str]:
    """Terms of the page's glossary: its own, those that a table links to, and those in the title of a chart.

    A run's page has its words as well.
    """
    tables = list(_tables([page.table, *page.sections]))
    linked = {*page.terms, *(column.term for table in tables for column in table.columns)}
    linked |= {row.term for table in tables for row in table.rows}
    titles = " ".join(chart["title"].lower() for chart in (page.plots or {}).get("charts", ()))
    terms = {term: text for term, text in TERMS.items() if term in linked or term.lower() in titles}
    return {**terms, **WORDS} if page.kind == "report" and terms else terms


def _tables(holders: Iterable[Any]) -> Iterator[Table]:
    """Tables of sections and of what is folded away in them."""
    for holder in holders:
        yield from (block.table for block in holder.blocks if isinstance(block, Grid))
        yield from _tables(block for block in holder.blocks if isinstance(block, Folded))


def _interactive(plots: Mapping[str, Any]) -> dict[str, Any]:
    """Properties of the plots that the template needs besides their data."""
    numbered = list(enumerate(plots["charts"]))
    shown = [(str(i), one["name"]) for i, one in enumerate(plots["estimators"]) if one["answered"]]
    has = {key: any(one.get(key) for one in plots["estimators"]) for key in ("points", "covariance")}
    has["band"] = any(one.get("covariance") for one in plots["estimators"] if one["name"] == plots["reference"])
    return {
        "script": script(),
        "data": embedded_json(plots),
        "groups": [(title, list(of)) for title, of in groupby(numbered, key=lambda item: item[1]["group"])],
        "has": has,
        "shown": shown if plots["truth"] is None else [*shown, (TRUTH_LINE, "truth")],
    }


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
