"""Model of a page: sentences (made in `phrases`), tables, figures and plots in sections, for the one template."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any, ClassVar

from markupsafe import Markup

from ..figures.style import TRUTH
from ..formatting import counted
from ..phrases.evidence import FIRST
from ..results.metric import TERMS, WORDS
from ..tables.table import Table
from .interactive import line_rules, policy, script
from .plot_encoding import TRUTH_LINE, embedded_json
from .templates import NO_SCRIPT, Picture, asset, environment


@dataclass(frozen=True, slots=True)
class Grid:
    """A table; `style` is main, plain or empty."""

    shape: ClassVar[str] = "grid"
    table: Table
    style: str = "main"


@dataclass(frozen=True, slots=True)
class Sentences:
    """A list."""

    shape: ClassVar[str] = "sentences"
    texts: Sequence[str]
    style: str = "verdict"


@dataclass(frozen=True, slots=True)
class Note:
    """A paragraph in small letters, or a heading within a section."""

    shape: ClassVar[str] = "note"
    text: str
    is_heading: bool = False


@dataclass(frozen=True, slots=True)
class Live:
    """Interactive plots: `charts` over time, or the images of `frame`."""

    shape: ClassVar[str] = "live"
    what: str


@dataclass(frozen=True, slots=True)
class Folded:
    """Blocks under a title that folds them away, with a word (`badge`) beside it."""

    shape: ClassVar[str] = "folded"
    title: str
    blocks: "Sequence[Block]"
    style: str = ""
    badge: str = ""
    is_open: bool = False


Block = Grid | Sentences | Note | Picture | Live | Folded


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
    """kind of result: report, comparison, diagnosis, bench"""
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


def render_page(page: Page) -> str:
    """HTML of a page: one file that needs no other and makes no request. All text that comes from files is escaped."""
    plots, keys = page.plots, {name: str(i) for i, name in enumerate(page.colors)}
    styles = asset("report.css") + (asset("explore.css") if page.colors else "")
    titles = {title: key for name, key in keys.items() for title in (name, f"{name} (reference)")}
    sections = [section for section in (page.table, *page.sections) if section.blocks]
    return (
        environment()
        .get_template("page.html")
        .render(
            page=page,
            most=FIRST,
            sections=sections,
            css=Markup(styles),
            glossary={**TERMS, **WORDS} if page.colors else {},
            line_rules=line_rules({**{keys[name]: color for name, color in page.colors.items()}, TRUTH_LINE: TRUTH}),
            classes={title: f"estimator-{key}" for title, key in titles.items()},
            policy=Markup(NO_SCRIPT) if plots is None else policy(),
            terms=_terms(page),
            **({} if plots is None else _interactive(plots)),
        )
    )


def _terms(page: Page) -> dict[str, str]:
    """Terms of the glossary that a table links to or the title of a chart has, and the words of a run's page."""
    tables = list(_tables([page.table, *page.sections]))
    linked = {column.term for table in tables for column in table.columns}
    linked |= {row.term for table in tables for row in table.rows}
    titles = " ".join(chart["title"].lower() for chart in (page.plots or {}).get("charts", ()))
    terms = {term: text for term, text in TERMS.items() if term in linked or term.lower() in titles}
    return {**terms, **WORDS} if page.kind == "report" and terms else terms


def _tables(holders: "Iterable[Section | Folded]") -> Iterator[Table]:
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
