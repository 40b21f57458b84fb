"""The page of a bench: one file that opens offline; only its links to the runs' pages lead out of it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.reports.figures.style import colors

from ..html.environment import environment, picture
from ..phrases.bench import FIGURES, NEES, TABLE, sentences
from ..results.bench import Results
from ..tables.bench import main_table, ranking_tables, runs_table
from .progress_events import duration
from .run_cache import RUNS

COSTS_APART = "Time and memory are of this machine; they stand in files of their own."
OPEN = 24
"""rows up to which a table is open from the start"""


def render(name: str, results: Results, figures: Mapping[str, Figure]) -> str:
    """`report.html`."""
    palette = colors(results.estimators, results.reference)
    return (
        environment()
        .get_template("bench.html")
        .render(
            name=name,
            results=results,
            spent=duration(results.seconds),
            verdict=sentences(results),
            table=main_table(results, with_costs=True, caption=f"{TABLE} {COSTS_APART}"),
            swatches={name: Markup(f'style="background: {color}"') for name, color in palette.items()},
            figures=[
                replace(picture(key, figure), caption=NEES if key.startswith("nees_") else FIGURES.get(key, ""))
                for key, figure in figures.items()
            ],
            tables=list(ranking_tables(results)),
            runs=runs_table(results, RUNS),
            most_open=OPEN,
            trees={"Versions": _part(results, "versions"), "Machine": _part(results, "machine")},
        )
    )


def _part(results: Results, part: str) -> Mapping[str, Any]:
    return next((summary[part] for summary in results.summaries.values()), {})
