"""What a bench reports: failures as rows with their reasons, an escaped page that needs nothing else, every table."""

import sys
import time
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from rich.progress import Progress

from fgbaseline.data import write_npz
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.reports.bench.command import BarDisplay
from fgbaseline.reports.bench.executors import FileChannel, ProgressEvent, outcomes, processes
from fgbaseline.reports.bench.folder import collect_results, open_cache, render
from fgbaseline.reports.bench.plan import plan
from fgbaseline.reports.bench.suite import read_suite
from fgbaseline.reports.bench.worker import Outcome, work
from fgbaseline.reports.figures.bench import draw
from fgbaseline.reports.formatting import unbroken
from fgbaseline.reports.phrases.bench import duration, sentences
from fgbaseline.reports.results import bench as tables
from fgbaseline.reports.results.bench import Planned, Results
from fgbaseline.reports.tables.bench import main_table
from fgbaseline.reports.tables.writers import latex, markdown

from ..builders.benches import written
from ..builders.commands import fgbaseline

SCRIPT = "<script>alert(1)<_script>"
METADATA = "Metadata-Version: 2.1\nName: dying\nVersion: 1.0\n"
DYING = """
import os
from fgbaseline.ekf import dead_reckoning

def solve(problem, progress=None):
    if problem.n_frames == 12:
        os.abort()
    if problem.n_frames == 14:
        raise ValueError("nothing <to> go_by")
    return dead_reckoning(problem, progress)
"""
WITH_ONE_THAT_DIES = """
name = "dying"
estimators = ["dead-reckoning", "dying"]
page = "none"
[[sequence]]
name = "drive"
simulate = { duration = [1.0, 1.2, 1.4], features_per_frame = 5 }
"""


def silent(key: str, doing: str, done: int, total: int) -> None:
    """A channel nobody listens to."""


@pytest.mark.slow
def test_a_process_that_dies_and_an_estimator_that_fails_are_rows_and_stop_nothing(tmp_path: Path) -> None:
    package = tmp_path / "packages"
    (package / "dying-1.0.dist-info").mkdir(parents=True)
    (package / "dying-1.0.dist-info" / "METADATA").write_text(METADATA)
    (package / "dying-1.0.dist-info" / "entry_points.txt").write_text("[fgbaseline.estimators]\ndying = dying:solve\n")
    (package / "dying.py").write_text(DYING)
    written(tmp_path, WITH_ONE_THAT_DIES)
    result = fgbaseline(
        *("bench", "suite.toml", "--out", "out", "--workers", "2"),
        cwd=tmp_path,
        drawing=False,
        first=lambda: sys.path.insert(0, str(package)),
        PYTHONPATH=str(package),
    )
    assert result.returncode == 1, result.stderr
    runs = pd.read_csv(tmp_path / "out" / "tables" / "runs.csv").set_index(["case", "estimator"])
    assert runs["status"].to_dict() == {
        ("drive duration=1", "dead-reckoning"): "ok",
        ("drive duration=1", "dying"): "ok",
        ("drive duration=1.2", "dead-reckoning"): "failed",
        ("drive duration=1.2", "dying"): "failed",
        ("drive duration=1.4", "dead-reckoning"): "ok",
        ("drive duration=1.4", "dying"): "failed",
    }
    assert "its process died" in runs.loc[("drive duration=1.2", "dying"), "reason"]
    assert "nothing <to> go_by" in runs.loc[("drive duration=1.4", "dying"), "reason"]
    assert "1 of 3 runs failed; the reasons are below" in result.stdout
    assert "dying failed in 1 of 3 runs" in result.stdout
    page = (tmp_path / "out" / "report.html").read_text()
    assert "nothing &lt;to&gt; go_by" in page
    assert "nothing <to>" not in page
    assert r"nothing \<to\> go\_by" in (tmp_path / "out" / "tables" / "table.md").read_text()
    assert r"go\_by" in (tmp_path / "out" / "tables" / "table.tex").read_text()


def test_a_recording_that_changes_during_the_run_is_refused(tmp_path: Path) -> None:
    drive = simulate(Simulation(duration=1.0, features_per_frame=5.0))
    write_npz(drive, tmp_path / "drive.npz")
    suite = 'name = "x"\nestimators = ["dead-reckoning"]\n[[sequence]]\nfiles = "drive.npz"\n'
    (job,) = plan(read_suite(written(tmp_path, suite)), None)
    write_npz(simulate(Simulation(duration=1.0, features_per_frame=5.0, seed=1)), tmp_path / "drive.npz")
    assert "the file has changed since the bench was planned" in work(job.job, silent).failure
    (tmp_path / "drive.npz").unlink()
    assert "there is no such file on the worker's machine" in work(job.job, silent).failure


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Of jobs done in this process, under a name that a page must escape."""
    folder = tmp_path_factory.mktemp("report")
    suite = f"""
name = "x"
estimators = ["dead-reckoning", "joint-ekf", "isam2"]
[sweep]
features = ["all", 10]
[[sequence]]
name = "{SCRIPT}"
simulate = {{ duration = 2, features_per_frame = 10 }}
seeds = {{ count = 3 }}
"""
    planned = plan(read_suite(written(folder, suite)), None)
    with open_cache(folder / "out", force=False) as cache:
        for one in planned:
            cache.store(work(one.job, silent))
        return collect_results(planned, cache)


def test_the_case_table_is_the_mean_of_its_runs(results: Results) -> None:
    table = tables.cases(results)
    assert len(table) == 2 * 3
    for row in tables.records(table):
        runs = results.runs[(results.runs["case"] == row["case"]) & (results.runs["estimator"] == row["estimator"])]
        assert row["runs"] == len(runs) == 3
        assert row["ate"] == pytest.approx(runs["ate"].mean())
        assert row["ate_low"] <= row["ate"] <= row["ate_high"]
    spent = tables.costs(results)
    assert (spent["seconds"] > 0.0).all()
    assert (spent["memory_mb"] > 50.0).all()


def test_the_best_is_marked_once_in_every_form(results: Results) -> None:
    grid = main_table(results, with_costs=False)
    headings = [column.heading for column in grid.columns]
    column = headings.index("ATE, m")
    for _, rows in grid.by_group:
        cells = [row.cells[column] for row in rows]
        (best,) = (cell.text for cell in cells if cell.best)
        assert best == min((cell.text for cell in cells), key=lambda text: float(text.split()[0]))
        assert f"**{best.split()[0]}" in markdown(grid)
        assert rf"\textbf{{{best.split()[0]}" in latex(grid)
    assert "time, s" not in headings
    assert "time, s" in [column.heading for column in main_table(results, with_costs=True).columns]
    text = latex(grid)
    assert text.count(r"\begin{") == text.count(r"\end{")
    widths = {line.count(" & ") for line in text.splitlines() if line.endswith(r"\\") and "multicolumn" not in line}
    assert widths == {len(headings)}


class Page(HTMLParser):
    """What a page asks for, and its text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.sources: list[str] = []
        self.links: list[str] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        given = dict(attrs)
        self.sources += [given["src"] or ""] if "src" in given else []
        self.links += [given["href"] or ""] if "href" in given else []

    def handle_data(self, data: str) -> None:
        self.text += data


def test_the_page_is_whole_escaped_and_leads_to_every_run(results: Results) -> None:
    figures = draw(results, tables.judge(results), tables.cases(results), tables.costs(results))
    assert set(figures) == {"accuracy", "accuracy_against_time", "scaling", "nees_1", "nees_2"}
    page = Page(render("x & y", results, figures))
    assert "script" not in page.tags
    assert SCRIPT in page.text
    assert "x & y" in page.text
    assert all(source.startswith("data:image/") for source in page.sources)
    assert len(page.sources) == 5
    keys = {one.job.key for one in results.planned}
    assert {link for link in page.links if not link.startswith("#")} == {f"runs/{key}/report.html" for key in keys}
    for sentence in sentences(results):
        assert unbroken(sentence) in page.text


def test_every_job_is_a_progress_event_and_the_bars_move(results: Results, tmp_path: Path) -> None:
    one: Planned = results.planned[0]
    with open_cache(tmp_path / "out", force=False) as cache:
        seen: list[ProgressEvent] = []
        (outcome,) = outcomes([one.job], processes(1, cache.folder), seen.extend)
    assert outcome.failure == ""
    assert any(
        event.key == one.job.key and event.doing in ("reading", "building the problem", "writing", *results.estimators)
        for event in seen
    )
    console = Console(file=StringIO(), force_terminal=True, width=120)
    whole, each = Progress(console=console), Progress(console=console)
    said: list[str] = []
    bars = BarDisplay({one.job.key: one}, whole, each, said.append)
    bars.update([ProgressEvent("1", one.job.key, "isam2", 5, 20), ProgressEvent("2", "", "", 0, 0)])
    assert [task.description for task in each.tasks] == [f"  {one.name}: isam2", "  waiting"]
    assert (each.tasks[0].completed, each.tasks[0].total) == (5, 20)
    bars.finish(Outcome(one.job.key, {}, "no luck", 1.0))
    assert whole.tasks[0].finished
    assert said == [f"{one.name}: failed: no luck"]


def test_events_are_the_last_of_each_worker_and_none_too_often(tmp_path: Path) -> None:
    channel = FileChannel(tmp_path)
    for frame in range(50):
        channel("key", "isam2", frame, 50)
    (event,) = channel.events()
    assert (event.key, event.doing, event.total) == ("key", "isam2", 50)
    assert event.done < 49
    time.sleep(0.4)
    channel("key", "isam2", 50, 50)
    assert next(channel.events()).done == 50


@pytest.mark.parametrize(("seconds", "text"), [(3.21, "3.2 s"), (250.0, "4.2 min"), (8000.0, "2.2 h")])
def test_durations_have_two_digits_and_the_largest_unit(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_ranks_over_cases_count_every_case_once(results: Results) -> None:
    table = tables.overall(results)
    assert set(table["estimator"]) == {"dead-reckoning", "joint-ekf", "isam2"}
    assert (table["cases"] == 2).all()
    assert table["mean_rank"].sum() == pytest.approx(6.0)
    assert np.all(np.diff(table["mean_rank"]) >= 0.0)
