"""Folder of a bench: finished runs, each under the key of its job, and the report on them; every write is atomic.

The report has reproducible tables, tables of time and memory, figures and a page.
"""

import fcntl
import json
import os
import shutil
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fgbaseline.data.formats.files.atomic_write import atomic_write
from fgbaseline.data.formats.files.file_errors import shown
from fgbaseline.geometry import FloatArray, InputError

from ..figures.bench import draw
from ..figures.drawing import encoded
from ..figures.style import colors
from ..formatting import counted
from ..html.page import Grid, Note, Page, Section, folded, pictures, render_page
from ..phrases.bench import FIGURES, TABLE, duration, sentences
from ..results import bench as statistics
from ..results.bench import ANSWERED, BENCH_METRICS, COSTS, OF_THE_RUN, Planned, Results
from ..results.json_files import INFINITE, at
from ..results.reader import RunFolder
from ..tables.bench import main_table, ranking_tables, runs_table
from ..tables.writers import latex, markdown
from .worker import COSTS as COSTS_FILE
from .worker import Outcome

MARK = "bench.json"
"""the file that marks a bench's folder"""
JOB = "job.json"
RUNS = "runs"
PARTIAL = ".partial"
SCHEMA: Final = "fgbaseline/bench/1"
OF_A_RUN = ("problem", "reference", "held_out", "estimators")
TIMINGS = ("seconds", "frames_per_second")
"""keys of an estimator's summary that differ between two runs of one job"""
COSTS_NOTE = "Time and memory are of this machine and in separate files."
RANKINGS = (
    '"Above the first" is the mean of the paired differences of the runs, with its 95 % interval. Where the interval '
    "contains zero, or the difference is at most 1 %, these runs do not separate the two. An estimator with fewer "
    "successful runs ranks below those with more."
)
MOST_OPEN = 24
"""rows up to which a table is open from the start"""


@dataclass(frozen=True, slots=True)
class RunCache:
    """The folder, locked against other benches: see `open_cache`."""

    folder: Path

    def run(self, key: str) -> Path:
        """The folder of a run."""
        return self.folder / RUNS / key

    def has(self, key: str) -> bool:
        """Whether the outcome of a job is stored."""
        return (self.run(key) / JOB).is_file()

    def record(self, key: str) -> dict[str, Any]:
        """Failure (empty where there is a run) and seconds of a finished job."""
        record: dict[str, Any] = json.loads((self.run(key) / JOB).read_text(encoding="utf-8"))
        return record

    def store(self, outcome: Outcome) -> None:
        """Writes the outcome of a job atomically."""
        building = self.run(outcome.key).with_name(outcome.key + PARTIAL)
        shutil.rmtree(building, ignore_errors=True)
        record = {"failure": outcome.failure, "seconds": outcome.seconds}
        for name, content in {**outcome.files, JOB: json.dumps(record).encode()}.items():
            path = building / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        building.rename(self.run(outcome.key))

    def write(self, name: str, content: bytes) -> None:
        """Writes a file of the report atomically."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as file:
            file.write(content)

    def remove_runs(self, *, keep: Collection[str] = ()) -> None:
        """Removes all runs except those to keep, and half-written ones."""
        for path in (self.folder / RUNS).iterdir():
            if path.name not in keep:
                shutil.rmtree(path)


@contextmanager
def open_cache(folder: Path, *, force: bool) -> Iterator[RunCache]:
    """Opens or creates the folder of a bench for the block; with `force` its runs are removed.

    Raises InputError for a folder of something else, one that cannot be written, or one that another bench writes to.
    """
    try:
        if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / MARK).is_file())):
            raise InputError(
                f"{shown(folder)}: it exists and is not the folder of a bench (it has no {MARK}); choose another --out"
            )
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / MARK).open("a+") as mark:
            try:
                fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"{shown(folder)}: another bench is writing to it; wait for that, or choose another --out"
                ) from None
            if os.fstat(mark.fileno()).st_size == 0:
                mark.write('{"schema": "fgbaseline/bench-folder/1"}\n')
                mark.flush()
            (folder / RUNS).mkdir(exist_ok=True)
            cache = RunCache(folder)
            names = [] if force else [path.name for path in (folder / RUNS).iterdir()]
            cache.remove_runs(keep=[name for name in names if cache.has(name) and not name.endswith(PARTIAL)])
            yield cache
    except OSError as error:
        raise InputError(
            f"{shown(folder)}: the folder cannot be written ({error.strerror or error}); choose another --out"
        ) from error


def write_report(name: str, results: Results, cache: RunCache) -> None:
    """Writes the report, `summary.json` last."""
    cases, costs = statistics.cases(results), statistics.costs(results)
    same = {
        "cases": cases,
        "runs": results.runs,
        "rankings": statistics.rankings(results),
        "overall": statistics.overall(results),
        "consistency": statistics.consistency(results),
        "nees_over_time": statistics.nees_over_time(results),
    }
    for title, frame in same.items():
        if len(frame):
            cache.write(f"tables/{title}.csv", _csv(frame))
    cache.write("costs/cases.csv", _csv(costs))
    cache.write("costs/runs.csv", _csv(results.costs))
    for folder in ("tables", "costs"):
        table = main_table(results, with_costs=folder == "costs", caption=TABLE)
        cache.write(f"{folder}/table.md", markdown(table).encode())
        cache.write(f"{folder}/table.tex", latex(table).encode())
    figures = draw(results, statistics.judge(results), cases, costs)
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
        if one.name in results.failures:
            failed = {"status": "failed", "reason": results.failures[one.name]}
            found: dict[str, Any] = {
                "reference": {"name": None, "trust": None, "reasons": []},
                "estimators": dict.fromkeys(one.job.estimators, failed),
            }
        else:
            found = {part: results.summaries[one.name][part] for part in OF_A_RUN}
        settings = {"seed": one.job.seed, **one.settings}
        runs[one.name] = {"sequence": {"name": one.sequence}, "settings": settings, "key": one.job.key, **found}
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
            nothing = {"status": "failed", "reason": failure, **{metric.name: np.nan for metric in BENCH_METRICS}}
            rows += [{**_of_run(one), "estimator": name, **nothing} for name in one.job.estimators]
            continue
        folder = RunFolder(cache.run(one.job.key))
        summary = folder.summary
        reference, size = summary["reference"], (summary["sequence"]["frames"], summary["problem"]["features"])
        offered = next(iter(summary["estimators"].values()))["observations"]["offered"]
        of_run = _of_run(one, reference["name"], reference["trust"], *size, offered)
        spent = json.loads((folder.folder / COSTS_FILE).read_text(encoding="utf-8"))["estimators"]
        for name, estimator in summary["estimators"].items():
            values = {metric.name: _at(estimator, metric.path) for metric in BENCH_METRICS}
            status = {"status": estimator["status"], "reason": estimator["reason"]}
            rows.append({**of_run, "estimator": name, **status, **values})
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


def _of_run(one: Planned, *found: object) -> dict[str, Any]:
    """The first columns of a run: its names, what was `found`, and the settings that vary."""
    names = zip(OF_THE_RUN, (one.name, one.case, one.sequence, one.job.seed, *found), strict=False)
    return {**dict(names), **{f"{name}_asked": words for name, words in one.settings.items()}}


def _at(estimator: Mapping[str, Any], path: tuple[str, ...]) -> float:
    value = at(estimator, *path)
    if value is None and estimator["notes"].get(".".join(path)) == INFINITE:
        return float("inf")
    return float(value) if isinstance(value, int | float) else float("nan")
