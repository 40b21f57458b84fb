"""The page from a run: what goes where."""

from collections import Counter
from collections.abc import Mapping
from itertools import groupby
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from fgbaseline.data import Event
from fgbaseline.reports.comparison import Run
from fgbaseline.reports.figures import Written

from ..formatting import per_cent
from .charts import TRUTH_LINE
from .colouring import colour_rules, keys
from .diagnosis import findings
from .environment import asset, environment, picture
from .evidence import EVIDENCE, evidence_table, folded_tables
from .packing import embedded_json
from .payload import payload
from .scripting import policy, script
from .table import main_table
from .verdict import verdict

FIRST_SENTENCES = 3
"""of the verdict that stand above the table"""
BESIDE_CHARTS = ("reprojection_over_time", "reprojection_distribution")
"""figures that stand beside the interactive charts, as they tell what these do not"""
MOST_EVENTS = 200
"""of an estimator that are listed one by one"""
REASONS: Mapping[str, str] = {
    "feature not chosen": "its feature is not among those asked for",
    "disparity": "its disparity is too small to tell the depth",
    "rows": "its rows in the left and right image disagree",
    "prediction": "it contradicts its own track, carried along by the velocities",
    "short": "what is left of its track is too short to check",
    "geometry": "its point is not determined, or lies behind a camera",
    "moving": "its point moved",
    "copied": "it is a copy of the frame before and was never tracked",
}


def render(run: Run, summary: Mapping[str, Any], figures: Mapping[str, Figure | Written]) -> str:
    """`report.html`: one file that needs no other and asks for nothing.

    `summary` is `summary.json` as a dict and gives the numbers, `figures` is what `figures.draw(run)` or
    `figures.draw_and_write(run)` gave. All text that comes from files is escaped.
    """
    pictures = {name: picture(name, figure) for name, figure in figures.items()}
    data = payload(run)
    numbered = list(enumerate(data["charts"]))
    return (
        environment()
        .get_template("report.html")
        .render(
            css=Markup(asset("report.css") + asset("explore.css")),
            colour_rules=colour_rules(run),
            script=script(),
            policy=policy(),
            data=embedded_json(data),
            groups=[(title, list(of)) for title, of in groupby(numbered, key=lambda item: item[1]["group"])],
            jumps=data["jumps"],
            frames_seen=data["observations"] is not None,
            keys=keys(run),
            shown=_shown(run),
            truth_line=TRUTH_LINE,
            run=run,
            summary=summary,
            sequence=summary.get("sequence", {}),
            problem=summary.get("problem", {}),
            verdict=verdict(run),
            first=FIRST_SENTENCES,
            findings=findings(run),
            repairs=run.problem.repairs,
            trust=run.trust.verdict.name.lower(),
            table=main_table(run, summary.get("estimators", {})),
            pictures=pictures,
            stills=[p for name, p in pictures.items() if not name.startswith((*EVIDENCE, *BESIDE_CHARTS))],
            evidence=evidence_table(run, summary.get("estimators", {})),
            folded=folded_tables(run),
            bands=[p for name, p in pictures.items() if name.startswith("three_sigma_")],
            components=_components(summary),
            excluded=_excluded(summary),
            events=_events(run),
        )
    )


def _shown(run: Run) -> list[tuple[str, str]]:
    """Key and name of everybody that can be switched on and off."""
    answered = [(keys(run)[result.name], result.name) for result in run.answered]
    return answered if run.problem.sequence.truth is None else [*answered, (TRUTH_LINE, "truth")]


def _components(summary: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Bias and spread of uL, vL, uR and vR by estimator, where an estimator has any."""
    components = {name: e.get("components") or {} for name, e in summary.get("estimators", {}).items()}
    return {n: c for n, c in components.items() if any(row.get("bias") is not None for row in c.values())}


def _excluded(summary: Mapping[str, Any]) -> list[tuple[str, int, str]]:
    """Reason in words, how many, and their share of all observations; the most frequent first."""
    counts: Mapping[str, int] = summary.get("problem", {}).get("excluded") or {}
    total = max(1, int(summary.get("sequence", {}).get("observations") or 0))
    ranked = sorted(((r, n) for r, n in counts.items() if n), key=lambda item: -item[1])
    return [(REASONS.get(r.replace("_", " "), r), n, per_cent(n / total)) for r, n in ranked]


def _events(run: Run) -> list[tuple[str, list[tuple[str, int]], tuple[Event, ...], int]]:
    """Estimator, how many of each kind, the first so many, and how many more there are; one run's events once."""
    listed = []
    seen: set[int] = set()
    for name, result in run.results.items():
        events = result.estimate.events
        if not events or id(events) in seen:
            continue
        seen.add(id(events))
        names = ", ".join(n for n, r in run.results.items() if r.estimate.events is events) or name
        kinds = Counter(event.kind for event in events).most_common()
        listed.append((names, kinds, events[:MOST_EVENTS], max(0, len(events) - MOST_EVENTS)))
    return listed
