"""Page of a result: its model (sentences made in `phrases`, tables, figures and plots in sections), and its HTML.

One template lays out all kinds. A page without plots has no script; none of them can load anything.
"""

import re
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from importlib.resources import files
from itertools import groupby
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from ..figures.drawing import EncodedFigure, encoded
from ..figures.style import TRUTH, dark_matrix
from ..formatting import counted, unbroken
from ..phrases.evidence import FIRST
from ..results.glossary import TERMS, WORDS
from ..results.provenance import creation
from ..tables.table import Table
from .plot_encoding import TRUTH_LINE, embedded_json, line_rules

LARGEST_SVG = 200_000
"""bytes, from which on the PNG takes its place"""
NO_SCRIPT = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""content security policy of a page without a script"""
SCRIPTS = ("data.js", "drawing.js", "chart.js", "path.js", "path_controls.js", "frame.js", "page.js")
"""a page's script in the order of its dependencies"""


@dataclass(frozen=True, slots=True)
class Grid:
    """A table, below its title or not."""

    table: Table
    style: str = "main"
    """main, plain or empty"""
    badges: Mapping[str, str] = field(default_factory=dict)
    """class of a badge by the text of its cell"""
    is_titled: bool = False


@dataclass(frozen=True, slots=True)
class Sentences:
    """A list."""

    texts: Sequence[str]
    style: str = "verdict"


@dataclass(frozen=True, slots=True)
class Note:
    """A paragraph in small letters, or a heading within a section."""

    text: str
    is_heading: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A still figure ready for an `img`."""

    name: str
    source: str
    """a data URI"""
    title: str
    caption: str
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Pair:
    """Figures side by side where there is room."""

    pictures: Sequence[Picture]


@dataclass(frozen=True, slots=True)
class Live:
    """Interactive plots: `charts` over time, or the images of `frame`."""

    what: str


@dataclass(frozen=True, slots=True)
class Folded:
    """Blocks under a title that folds them away, with a word (`badge`) beside it."""

    title: str
    blocks: "Sequence[Block]"
    style: str = ""
    badge: str = ""
    is_open: bool = False


Block = Grid | Sentences | Note | Picture | Pair | Live | Folded


@dataclass(frozen=True, slots=True)
class Section:
    """Blocks under a heading; left out where there are none."""

    id: str
    title: str
    blocks: Sequence[Block]
    short: str = ""
    """title among the links at the top"""
    needs_script: bool = False


@dataclass(frozen=True, slots=True)
class Page:
    """Content of a page. Verdict and table come first, paths beside them, then the sections."""

    kind: str
    """kind of result: report, comparison, diagnosis, bench, reproduction"""
    title: str
    about: str
    """a sentence or two below the title"""
    verdict: Sequence[str]
    table: Section
    sections: Sequence[Section]
    record: Sequence[Block] = ()
    """blocks above the settings"""
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """title -> settings, versions and the like, at the end"""
    colors: Mapping[str, str] = field(default_factory=dict)
    """color of each name in tables and plots; in the order of `plots["estimators"]`, where there are plots"""
    plots: Mapping[str, Any] | None = None
    """see `plot_data.page_data`"""
    still_paths: Picture | None = None
    """in place of the paths where no script runs"""
    terms: Iterable[str] = ()
    """terms of the glossary beside those that tables link to and titles of charts have"""


def pictures(figures: Mapping[str, Figure | EncodedFigure], captions: Mapping[str, str]) -> dict[str, Picture]:
    """Figures by name, ready for a page; captions are by the beginning of a name, of which the longest counts."""
    drawn = {}
    for name, figure in figures.items():
        beginning = max((start for start in captions if name.startswith(start)), key=len, default="")
        drawn[name] = _picture(name, figure, captions.get(beginning, ""))
    return drawn


def _picture(name: str, figure: Figure | EncodedFigure, caption: str) -> Picture:
    """The figure as SVG, or as PNG where that would be too large."""
    svg = encoded(figure, "svg")
    form, content = ("svg+xml", svg) if len(svg) <= LARGEST_SVG else ("png", encoded(figure, "png"))
    if isinstance(figure, EncodedFigure):
        title, (width, height) = figure.title, figure.size
    else:
        title, (width, height) = str(figure.get_label()), figure.get_size_inches()
    source = f"data:image/{form};base64,{b64encode(content).decode('ascii')}"
    return Picture(name, source, title.replace(r"\$", "$"), caption, round(100 * width), round(100 * height))


def trust(name: str, verdict_on_it: str, reasons: Iterable[str], criteria: Table | None = None) -> Folded:
    """Trust in a reference: its reasons and its criteria, folded away."""
    blocks: list[Block] = [Sentences(list(reasons), "reasons")]
    blocks += [Grid(criteria, "plain criteria")] if criteria is not None and criteria.rows else []
    return Folded(f"Reference: {name}", blocks, f"trust {verdict_on_it}", badge=verdict_on_it)


def folded(table: Table, most_open: int = 0) -> Folded:
    """A table under its title, open where it has at most so many rows."""
    return Folded(table.title, [Grid(table, "plain")], is_open=len(table.rows) <= most_open)


def still_figures(stills: list[Block]) -> Folded:
    """Figures that the interactive plots stand for on the screen."""
    return Folded(f"The other {counted(len(stills), 'figure')} of the folder figures/", stills, "stills")


def figure_blocks(pictures: Mapping[str, Picture], names: Iterable[str]) -> list[Block]:
    """The figures of these names that were drawn."""
    return [pictures[name] for name in names if name in pictures]


def render_page(page: Page) -> str:
    """HTML of a page: one file that needs no other and makes no request. All text that comes from files is escaped."""
    plots, keys = page.plots, {name: str(i) for i, name in enumerate(page.colors)}
    titles = {title: key for name, key in keys.items() for title in (name, f"{name} (reference)")}
    template = environment().get_template("page.html")
    return template.render(
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


def environment() -> Environment:
    """Templates beside this module; everything is escaped, and an unknown name is an error."""
    jinja = Environment(
        loader=FunctionLoader(asset), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    jinja.filters |= {"flattened": flattened, "anchor": anchor, "unbroken": unbroken}
    jinja.filters["shape"] = lambda block: type(block).__name__
    return jinja


def asset(name: str) -> str:
    """A template, style sheet or script of this folder."""
    return files("fgbaseline.reports.html").joinpath(name).read_text(encoding="utf-8")


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
