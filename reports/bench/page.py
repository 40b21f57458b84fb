"""The page of a bench."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure

from ..figures.style import colors
from ..formatting import counted, interval
from ..html.environment import environment, picture
from .grid import main_grid
from .progress import duration
from .results import METRICS, Results
from .store import RUNS
from .tables import overall, rankings, records
from .wording import sentences

WORDS = ("estimator", "by", "")
"""headings of columns of words"""
CAPTIONS = {
    "accuracy": "One mark an estimator; where there are several seeds, the line is the 95 % interval of the mean.",
    "accuracy_against_time": "The time an estimator took for a frame, on this machine and beside the other workers.",
    "scaling": "One mark a run; dashed the power of n that fits best, where sizes differ enough. Memory is that of the "
    "whole process while an estimator worked, some 200 MB of libraries among it.",
}
OF_NEES = (
    "Each frame's NEES averaged over the runs. Inside the band it is what covariances that tell the truth would give; "
    "errors of neighbouring frames are nearly the same, so a curve stays where it has strayed to for a while."
)


@dataclass(frozen=True, slots=True)
class Table:
    """A table in words, beside the main one."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def render(name: str, results: Results, figures: Mapping[str, Figure]) -> str:
    """`report.html`: one file that opens offline; only its links to the runs' pages lead out of it."""
    grid = main_grid(results, with_costs=True)
    return (
        environment()
        .get_template("bench.html")
        .render(
            css=Markup(files("fgbaseline.reports.html").joinpath("report.css").read_text(encoding="utf-8")),
            name=name,
            results=results,
            spent=duration(results.seconds),
            verdict=sentences(results),
            grid=grid,
            colours=colors(results.estimators, results.reference),
            figures=[_captioned(key, picture(key, figure)) for key, figure in figures.items()],
            words=WORDS,
            tables=[table for table in (*_rankings(results), _overall(results)) if table is not None],
            runs=_runs(results),
            versions=_record(results, "versions"),
            machine=_record(results, "machine"),
        )
    )


def _captioned(key: str, shown: Any) -> dict[str, Any]:
    caption = OF_NEES if key.startswith("nees_") else CAPTIONS.get(key, "")
    fields = ("name", "source", "title", "width", "height")
    return {**{field: getattr(shown, field) for field in fields}, "caption": caption}


def _rankings(results: Results) -> Iterable[Table]:
    table = rankings(results)
    for metric in METRICS:
        rows = [
            (
                row["case"],
                str(row["rank"]),
                row["estimator"],
                str(row["runs"]),
                interval(row["mean"], row["low"], row["high"]),
                "" if row["rank"] == 1 else interval(row["behind"], row["behind_low"], row["behind_high"]),
                "cannot be told from it" if row["tied"] and row["rank"] > 1 else "",
            )
            for row in records(table)
            if row["metric"] == metric.name
        ]
        if rows:
            headings = ("case", "rank", "estimator", "runs", metric.heading, "behind the first", "")
            yield Table(f"Ranked by {metric.heading}", headings, tuple(rows))


def _overall(results: Results) -> Table | None:
    table = overall(results)
    if table.empty:
        return None
    headings = {metric.name: metric.heading for metric in METRICS}
    rows = tuple(
        (
            row["estimator"],
            headings[row["metric"]],
            str(row["cases"]),
            interval(row["mean_rank"], row["low"], row["high"]),
            str(row["first"]),
        )
        for row in records(table)
    )
    return Table("Over all cases", ("estimator", "by", "cases", "mean rank", "first in"), rows)


def _runs(results: Results) -> list[dict[str, str]]:
    """Each run with its page, or why there is none, and how far its reference is trusted."""
    by_run: Mapping[Any, pd.DataFrame] = dict(list(results.runs.groupby("run")))
    listed = []
    for one in results.planned:
        rows = by_run[one.name]
        first, failure = rows.iloc[0], results.failures.get(one.name, "")
        page = "" if failure or one.job.page == "none" else f"{RUNS}/{one.job.key}/report.html"
        failed = rows[rows["status"] == "failed"]
        said = failure or "; ".join(f"{row['estimator']} failed: {row['reason']}" for row in records(failed))
        size = (
            ""
            if failure
            else f"{counted(int(first['frames']), 'frame')}, {counted(int(first['observations']), 'match', 'matches')}"
        )
        trust = "" if failure else f"{first['reference']} {first['trust']}"
        listed.append({"name": one.name, "page": page, "reason": said, "size": size, "trust": trust})
    return listed


def _record(results: Results, part: str) -> Mapping[str, Any]:
    return next((summary[part] for summary in results.summaries.values()), {})
