"""Fills the page of a run."""

from collections.abc import Mapping
from itertools import groupby
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.compare.estimate_comparison import Run

from ..figures import EncodedFigure
from ..figures.style import TRUTH, colors
from ..phrases.evidence import FIRST
from ..phrases.run import verdict
from ..tables import run as tables
from .environment import asset, environment, picture
from .explore import line_rules, policy, script
from .plot_data import TRUTH_LINE, embedded_json, page_data

SHOWN_FIGURES = (
    "reprojection_distribution",
    "held_out",
    "three_sigma_",
    "reprojection_classes",
    "image_regions",
    "map_difference",
)
"""beginnings of the names of the figures that show what no interactive chart does; the others are folded away"""


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
            line_rules=line_rules(
                {**colors(run.results, run.reference), TRUTH_LINE: TRUTH}, {**keys, TRUTH_LINE: TRUTH_LINE}
            ),
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
            stills=[p for name, p in pictures.items() if not name.startswith(SHOWN_FIGURES)],
        )
    )
