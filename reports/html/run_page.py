"""Fills the page of a run."""

from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from importlib.resources import files
from itertools import groupby
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.compare.estimate_comparison import Run

from ..figures import EncodedFigure
from ..figures.style import TRUTH, colors, on_dark
from ..phrases.evidence import FIRST
from ..phrases.run import verdict
from ..tables import run as tables
from .environment import asset, environment, picture
from .plot_data import TRUTH_LINE, embedded_json, page_data

EVIDENCE_FIGURES = ("held_out", "three_sigma_", "reprojection_classes", "map_difference")
"""beginnings of the names of the figures that stand beside the evidence"""
CHART_FIGURES = ("reprojection_over_time", "reprojection_distribution")
"""figures that stand beside the interactive charts, because they show what these do not"""
SCRIPTS = ("data.js", "drawing.js", "chart.js", "path.js", "frame.js", "page.js")
"""the page's script in the order of its dependencies"""


def render(run: Run, summary: Mapping[str, Any], figures: Mapping[str, Figure | EncodedFigure]) -> str:
    """`report.html`: one file that needs no other and makes no request.

    `summary` is `summary.json` as a dict and gives the numbers, `figures` is what `figures.draw(run)` or
    `figures.draw_and_write(run)` gave. All text that comes from files is escaped.
    """
    pictures = {name: picture(name, figure) for name, figure in figures.items()}
    data = page_data(run)
    numbered = list(enumerate(data["charts"]))
    keys = {name: str(i) for i, name in enumerate(run.results)}
    estimators = summary.get("estimators", {})
    shown = [(keys[result.name], result.name) for result in run.answered]
    if run.problem.sequence.truth is not None:
        shown.append((TRUTH_LINE, "truth"))
    return (
        environment()
        .get_template("run.html")
        .render(
            css=Markup(asset("report.css") + asset("explore.css")),
            color_rules=_color_rules(run, keys),
            script=script(),
            policy=policy(),
            data=embedded_json(data),
            groups=[(title, list(of)) for title, of in groupby(numbered, key=lambda item: item[1]["group"])],
            bookmarks=data["bookmarks"],
            frames_seen=data["observations"] is not None,
            classes={name: f"estimator-{key}" for name, key in keys.items()},
            shown=shown,
            run=run,
            summary=summary,
            sequence=summary.get("sequence", {}),
            problem=summary.get("problem", {}),
            verdict=verdict(run),
            first=FIRST,
            criteria=tables.trust_table(run.trust.criteria),
            trust_in_reference=run.trust.verdict.name.lower(),
            table=tables.main_table(run, estimators),
            evidence=tables.evidence_table(run, estimators),
            long_tables=tables.long_tables(run),
            components=tables.components_table(estimators),
            findings=tables.findings_table(run.problem.findings),
            excluded=tables.exclusions_table(summary),
            events=tables.events_tables(run),
            pictures=pictures,
            bands=[p for name, p in pictures.items() if name.startswith("three_sigma_")],
            stills=[p for name, p in pictures.items() if not name.startswith((*EVIDENCE_FIGURES, *CHART_FIGURES))],
        )
    )


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


def _color_rules(run: Run, keys: Mapping[str, str]) -> Markup:
    """`.estimator-KEY` sets `--estimator`, the color of an estimator on light and on dark ground."""
    light = {keys[name]: color for name, color in colors(run.results, run.reference).items()} | {"truth": TRUTH}
    rules = [
        "\n".join(f".estimator-{key} {{ --estimator: {color}; }}" for key, color in ground.items())
        for ground in (light, {key: on_dark(color) for key, color in light.items()})
    ]
    return Markup(f"{rules[0]}\n@media screen and (prefers-color-scheme: dark) {{\n{rules[1]}\n}}")
