"""Report of a bench: results of its runs, reproducible tables, tables of time and memory, figures and page."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fgbaseline.geometry import FloatArray

from ..figures.bench import draw
from ..figures.drawing import encoded
from ..figures.style import colors
from ..formatting import counted
from ..html.page import Grid, Note, Page, Section, folded, pictures, render_page
from ..phrases.bench import FIGURES, TABLE, sentences
from ..results import bench as statistics
from ..results.bench import ANSWERED, BENCH_METRICS, COSTS, OF_THE_RUN, Results
from ..results.json_files import INFINITE, at
from ..results.reader import RunFolder
from ..tables.bench import main_table, ranking_tables, runs_table
from ..tables.table import latex, markdown
from .job import Planned
from .progress import duration
from .run_cache import RUNS, RunCache
from .worker import COSTS as COSTS_FILE

SCHEMA: Final = "fgbaseline/bench/1"
OF_A_RUN = ("problem", "reference", "held_out", "estimators")
TIMINGS = ("seconds", "frames_per_second")
"""keys of an estimator's summary that differ between two runs of one job"""
COSTS_NOTE = "Time and memory are of this machine and in separate files."
RANKINGS = (
    '"Above the first" is the mean of the paired differences of the runs, with its 95 % interval. Where the interval '
    "contains zero, these runs do not separate the two. An estimator with fewer successful runs ranks below those "
    "with more."
)
MOST_OPEN = 24
"""rows up to which a table is open from the start"""


def write_report(name: str, results: Results, cache: RunCache) -> None:
    """Writes the report, each file atomically, `summary.json` last."""
    same = {
        "cases": statistics.cases(results),
        "runs": results.runs,
        "rankings": statistics.rankings(results),
        "overall": statistics.overall(results),
        "consistency": statistics.consistency(results),
        "nees_over_time": statistics.nees_over_time(results),
    }
    for title, frame in same.items():
        if len(frame):
            cache.write(f"tables/{title}.csv", _csv(frame))
    cache.write("costs/cases.csv", _csv(statistics.costs(results)))
    cache.write("costs/runs.csv", _csv(results.costs))
    for folder in ("tables", "costs"):
        table = main_table(results, with_costs=folder == "costs", caption=TABLE)
        cache.write(f"{folder}/table.md", markdown(table).encode())
        cache.write(f"{folder}/table.tex", latex(table).encode())
    figures = draw(results, statistics.judge(results), statistics.cases(results), statistics.costs(results))
    for title, figure in figures.items():
        for form in ("png", "svg"):
            cache.write(f"figures/{title}.{form}", encoded(figure, form))
    cache.write("report.html", render(name, results, figures).encode())
    cache.write("summary.json", summarize(name, results).encode())


def _csv(table: pd.DataFrame) -> bytes:
    return table.to_csv(index=False, float_format="%.9g", lineterminator="\n").encode()


def render(name: str, results: Results, figures: Mapping[str, Figure]) -> str:
    """The page `report.html`, which opens offline; it links to the pages of the runs."""
    about = (
        f"{', '.join(results.estimators)} on {counted(len(results.cases), 'case')}, "
        f"{counted(len(results.planned), 'run')} that took {duration(results.seconds)} together."
    )
    table, runs = main_table(results, with_costs=True, caption=f"{TABLE} {COSTS_NOTE}"), runs_table(results, RUNS)
    rankings = [folded(one, MOST_OPEN) for one in ranking_tables(results)]
    return render_page(
        Page(
            kind="bench",
            title=name,
            about=about,
            verdict=sentences(results),
            table=Section("table", "Every case", [Grid(table)], "Table"),
            sections=[
                Section("figures", "Figures", list(pictures(figures, FIGURES).values())),
                Section("rankings", "Rankings", [Note(RANKINGS), *rankings] if rankings else []),
                Section("runs", "Every run", [folded(runs, MOST_OPEN)], "Runs"),
            ],
            settings={
                f"{title} of the runs": next((summary[part] for summary in results.summaries.values()), {})
                for title, part in {"Versions": "versions", "Machine": "machine"}.items()
            },
            colors=colors(results.estimators, results.reference),
        )
    )


def summarize(name: str, results: Results) -> str:
    """`summary.json` for `fgbaseline check`: metrics without timings, the same for the same jobs."""
    runs: dict[str, Any] = {}
    for one in results.planned:
        record = {
            "sequence": {"name": one.sequence},
            "settings": {"seed": one.job.seed, **one.settings},
            "key": one.job.key,
        }
        if one.name in results.failures:
            failed = {"status": "failed", "reason": results.failures[one.name]}
            no_reference: dict[str, Any] = {"name": None, "trust": None, "reasons": []}
            runs[one.name] = {
                **record,
                "reference": no_reference,
                "estimators": dict.fromkeys(one.job.estimators, failed),
            }
        else:
            summary = results.summaries[one.name]
            runs[one.name] = {**record, **{part: summary[part] for part in OF_A_RUN}}
    document = {
        "schema": SCHEMA,
        "suite": name,
        "versions": next((summary["versions"] for summary in results.summaries.values()), {}),
        "runs": runs,
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def collect_results(planned: Sequence[Planned], cache: RunCache) -> Results:
    """Collects the results of jobs, all of which have run."""
    rows: list[dict[str, Any]] = []
    costs: list[dict[str, Any]] = []
    summaries, failures = {}, {}
    nees: dict[tuple[str, str], list[FloatArray]] = {}
    for one in planned:
        if failure := str(cache.record(one.job.key)["failure"]):
            failures[one.name] = failure
            rows += _failed(one, failure)
            continue
        folder = RunFolder(cache.run(one.job.key))
        summary = folder.summary
        of_run = _of_run(one, summary)
        spent = json.loads((folder.folder / COSTS_FILE).read_text(encoding="utf-8"))["estimators"]
        for name, estimator in summary["estimators"].items():
            rows.append({**of_run, **_row(name, estimator)})
            if estimator["status"] in ANSWERED:
                costs.append({**of_run, "estimator": name, **spent[name]})
            if estimator["nees"] is not None:
                column = folder.series(name)["nees"].to_numpy(dtype=np.float64)
                nees.setdefault((one.case, name), []).append(column)
            for key in TIMINGS:
                del estimator[key]
        summaries[one.name] = summary
    seconds = sum(cache.record(key)["seconds"] for key in {one.job.key for one in planned})
    table = pd.DataFrame(costs, columns=list(COSTS))
    return Results(planned, pd.DataFrame(rows), table, summaries, failures, nees, seconds)


def _of_run(one: Planned, summary: Mapping[str, Any]) -> dict[str, Any]:
    reference, size = summary["reference"], (summary["sequence"]["frames"], summary["problem"]["features"])
    offered = next(iter(summary["estimators"].values()))["observations"]["offered"]
    return _planned(one, reference["name"], reference["trust"], *size, offered)


def _planned(one: Planned, *found: object) -> dict[str, Any]:
    """The first columns of a run: its names, what was `found`, and the settings that vary."""
    names = zip(OF_THE_RUN, (one.name, one.case, one.sequence, one.job.seed, *found), strict=False)
    return {**dict(names), **{f"{name}_asked": words for name, words in one.settings.items()}}


def _row(name: str, estimator: Mapping[str, Any]) -> dict[str, Any]:
    values = {metric.name: _at(estimator, metric.path) for metric in BENCH_METRICS}
    return {"estimator": name, "status": estimator["status"], "reason": estimator["reason"], **values}


def _failed(one: Planned, failure: str) -> list[dict[str, Any]]:
    nothing = {"status": "failed", "reason": failure, **{metric.name: np.nan for metric in BENCH_METRICS}}
    return [{**_planned(one), "estimator": name, **nothing} for name in one.job.estimators]


def _at(estimator: Mapping[str, Any], path: tuple[str, ...]) -> float:
    value = at(estimator, *path)
    if value is None and estimator["notes"].get(".".join(path)) == INFINITE:
        return float("inf")
    return float(value) if isinstance(value, int | float) else float("nan")
