"""Model of a page: sentences (made in `phrases`), tables, figures and plots in sections, for `rendering`."""

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from matplotlib.figure import Figure

from ..figures.saving import EncodedFigure, encoded
from ..tables.table import Table

LARGEST_SVG = 200_000
"""bytes, from which on the PNG takes its place"""


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
        drawn[name] = picture(name, figure, captions.get(beginning, ""))
    return drawn


def picture(name: str, figure: Figure | EncodedFigure, caption: str) -> Picture:
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
    return Folded(f"{len(stills)} figures as they stand in the folder figures/", stills, "stills")


def figure_blocks(pictures: Mapping[str, Picture], names: Iterable[str]) -> list[Block]:
    """The figures of these names that were drawn."""
    return [pictures[name] for name in names if name in pictures]
