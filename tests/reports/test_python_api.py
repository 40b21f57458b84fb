"""`fgbaseline.run` and `fgbaseline.compare_trajectories` answer as the commands do; arrays may stand for files."""

# ruff: noqa: ARG005

import inspect
import json
import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import click
import numpy as np
import pandas as pd
import pytest

import fgbaseline
from fgbaseline import data, ekf
from fgbaseline.data import Estimate, Problem, Sequence
from fgbaseline.data.problem_export import write_problem
from fgbaseline.geometry import InputError, se3
from fgbaseline.reports.cli import COMMANDS
from fgbaseline.reports.comparison import ComparisonReport
from fgbaseline.reports.problem import DEFAULT_ESTIMATORS
from fgbaseline.reports.problem.settings import named_estimators
from fgbaseline.reports.python_interface import in_python
from fgbaseline.reports.run.api import RunReport

from ..builders.commands import everything_in
from ..builders.commands import fgbaseline as command
from ..builders.empty_figures import figures_left_empty
from ..builders.synthetic import drive

NAMES = ["dead-reckoning", "ekf", "isam2"]
TIMINGS = ("seconds", "frames_per_second")


def mine(problem: Problem, progress: object = None) -> Estimate:
    """A filter of the user: dead reckoning that drifts upward."""
    poses = ekf.dead_reckoning(problem).world_T_imu.copy()
    poses[:, :3, 3] += 0.01 * np.arange(len(poses))[:, None] * problem.sequence.up
    return Estimate("whatever", poses, np.zeros(len(problem.excluded), dtype=np.bool_))


@pytest.fixture(scope="module")
def sequence() -> Sequence:
    return drive(seconds=4.0, features_per_frame=15.0)


@pytest.fixture(scope="module")
def result(sequence: Sequence) -> RunReport:
    return fgbaseline.run(sequence, estimators=[*NAMES, mine], as_recorded=True)


@pytest.fixture(scope="module")
def paths(result: RunReport, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Truth and estimates as files, the problem as a folder."""
    folder = tmp_path_factory.mktemp("paths")
    recorded = result.problem.sequence
    assert recorded.truth is not None
    data.write_tum(folder / "truth.tum", recorded.t, recorded.truth.world_T_imu)
    for name in ("ekf", "mine"):
        data.write_tum(folder / f"{name}.tum", recorded.t, result.results[name].estimate.world_T_imu)
    (folder / "problem").mkdir()
    write_problem(result.problem, folder / "problem")
    return folder


def without_times(folder: Path) -> tuple[dict[str, Any], pd.DataFrame]:
    """Summary and metrics of a run's folder, without what a clock has measured."""
    summary = json.loads((folder / "summary.json").read_text())
    for estimator in summary["estimators"].values():
        for name in TIMINGS:
            estimator.pop(name)
    metrics = pd.read_csv(folder / "metrics.csv")
    return summary, metrics[~metrics["metric"].isin(TIMINGS)].reset_index(drop=True)


def json_of(page: Path) -> dict[str, Any]:
    """Data of the plots of a page."""
    held: dict[str, Any] = json.loads(page.read_text(encoding="utf-8").partition('id="run">')[2].partition("</")[0])
    return held


def test_run_writes_the_folder_of_the_command(
    sequence: Sequence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    data.write_npz(sequence, tmp_path / "drive.npz")
    asked = ("--estimators", ",".join(NAMES), "--as-recorded", "--held-out", "0.2")
    ended = command("run", "drive.npz", *asked, "--out", "theirs", cwd=tmp_path, drawing=False)
    assert ended.returncode == 0, ended.stderr
    figures_left_empty(monkeypatch)
    result = fgbaseline.run("drive.npz", estimators=NAMES, as_recorded=True, held_out=0.2)
    page = result.report("ours")
    assert page == Path("ours/report.html")
    assert set(everything_in(tmp_path / "ours")) == set(everything_in(tmp_path / "theirs"))
    for theirs, ours in zip(*map(without_times, (tmp_path / "theirs", tmp_path / "ours")), strict=True):
        if isinstance(theirs, pd.DataFrame):
            pd.testing.assert_frame_equal(theirs, ours)
        else:
            assert theirs == ours
    assert all(sentence in ended.stdout.replace("\n", " ") for sentence in result.verdict[:3])
    with pytest.raises(InputError, match=r"ours: the folder exists; .*force=True"):
        result.report("ours")
    assert result.report("ours", force=True) == page
    alone = result.report("ours.html")
    assert alone == Path("ours.html")
    assert json_of(alone)["charts"] == json_of(page)["charts"]
    with pytest.raises(InputError, match=r"ours.html: .*force=True"):
        result.report("ours.html")


def test_compare_trajectories_answers_as_the_command(paths: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(paths)
    ended = command(
        "compare", "truth.tum", "ekf.tum", "it=mine.tum", "--align", "yaw", "--out", "theirs", cwd=paths, drawing=False
    )
    assert ended.returncode == 0, ended.stderr
    figures_left_empty(monkeypatch)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")  # the pages have the second in which they were written
    result = fgbaseline.compare_trajectories("truth.tum", ["ekf.tum", "it=mine.tum"], align="yaw")
    result.report("ours")
    assert everything_in(paths / "ours") == everything_in(paths / "theirs")
    assert result.report("ours.html").read_text() == (paths / "ours" / "report.html").read_text()
    named = fgbaseline.compare_trajectories("truth.tum", {"ekf": Path("ekf.tum"), "it": "mine.tum"}, align="yaw")
    pd.testing.assert_frame_equal(named.metrics, result.metrics)


@pytest.mark.parametrize("name", ["run", "compare"])
def test_every_option_of_the_command_is_a_keyword(name: str) -> None:
    function, others = (fgbaseline.run, {"out", "force", "open", "estimator", "rerun"})
    if name == "compare":
        function, others = fgbaseline.compare_trajectories, {"out", "force", "open"}
    options = {
        option.removeprefix("--").replace("-", "_")
        for parameter in COMMANDS[name].params
        if isinstance(parameter, click.Option)
        for option in parameter.opts
    }
    renamed = {"delta": "deltas", "format": "form"}
    keywords = {p.name for p in inspect.signature(function).parameters.values() if p.kind is p.KEYWORD_ONLY}
    assert {renamed.get(option, option) for option in options - others} == keywords - {"processes", "progress"}
    described = inspect.getdoc(function) or ""
    assert all(f"\n    {keyword}: " in described for keyword in keywords)


def test_arrays_estimates_and_files_of_one_path_give_the_same_figures(result: RunReport, paths: Path) -> None:
    recorded, estimate = result.problem.sequence, result.results["mine"].estimate
    assert recorded.truth is not None
    expected = fgbaseline.compare_trajectories(paths / "truth.tum", {"mine": paths / "mine.tum"}).table
    t, poses = recorded.t, estimate.world_T_imu
    forms: dict[str, tuple[Any, Any, dict[str, Any]]] = {
        "arrays": ((t, recorded.truth.world_T_imu), {"mine": (t, poses)}, {}),
        "trajectories": (data.Trajectory(t, recorded.truth.world_T_imu), data.Trajectory(t, poses, "mine"), {}),
        "frames with their times": (recorded.truth, {"mine": poses}, {"times": t}),
        "an estimate with its recording": (
            recorded.truth,
            [Estimate("mine", poses, estimate.used)],
            {"sequence": recorded},
        ),
    }
    for form, (reference, estimates, options) in forms.items():
        found = fgbaseline.compare_trajectories(reference, estimates, **options).table
        pd.testing.assert_frame_equal(found.loc[expected.index], expected, rtol=1e-7, obj=form)


def test_an_estimate_brings_its_stamps_landmarks_and_covariances(result: RunReport, paths: Path) -> None:
    recorded, estimate = result.problem.sequence, result.results["ekf"].estimate
    assert recorded.truth is not None
    with_files = fgbaseline.compare_trajectories(paths / "truth.tum", paths / "ekf.tum", sequence=paths / "problem")
    in_memory = fgbaseline.compare_trajectories(recorded.truth, estimate, sequence=result.problem)
    rows = with_files.table.index
    pd.testing.assert_frame_equal(in_memory.table.loc[rows], with_files.table, rtol=1e-7)
    more = set(in_memory.table.index) - set(rows)
    assert {"reprojection error: median, px", "NEES: mean"} <= more
    assert np.isfinite(in_memory.table.loc[sorted(more), "ekf"]).all()


def test_a_run_in_memory_is_a_reference_as_its_folder_is(
    result: RunReport, paths: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figures_left_empty(monkeypatch)
    result.report(tmp_path / "run")
    theirs = fgbaseline.compare_trajectories(
        tmp_path / "run", {"again": paths / "mine.tum"}, sequence=paths / "problem"
    )
    ours = fgbaseline.compare_trajectories(result, {"again": paths / "mine.tum"})
    assert ours.verdict[0] == theirs.verdict[0]
    pd.testing.assert_frame_equal(ours.table, theirs.table, rtol=1e-6)


def test_positions_alone_and_missing_poses_are_compared_where_they_are(result: RunReport) -> None:
    estimate = result.results["mine"].estimate
    t, poses = result.problem.sequence.t, estimate.world_T_imu.copy()
    poses[-5:] = np.nan
    found = fgbaseline.compare_trajectories((t, estimate.world_T_imu[:, :3, 3]), {"a": (t, poses)}, align="none")
    assert len(found.results["a"].matched) == len(t) - 5
    assert found.table.loc["ATE: max, m", "a"] < 1e-9


def test_arrays_without_a_name_are_reference_and_estimates() -> None:
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, 0, 3] = np.arange(20.0)
    path = (np.arange(20.0), poses)
    found = fgbaseline.compare_trajectories(path, [path, path])
    assert [found.reference.name, *found.results] == ["reference", "estimate", "estimate-2"]


def test_functions_alone_run_beside_the_defaults_of_the_command(sequence: Sequence) -> None:
    found = fgbaseline.run(sequence, estimators=[mine], as_recorded=True)
    assert list(found.results) == [*DEFAULT_ESTIMATORS, "mine", "batch"]


def test_functions_run_under_their_names(tmp_path: Path) -> None:
    assert named_estimators("ekf, isam2") == (("ekf", "isam2"), {})
    assert named_estimators(["ekf", mine]) == (("ekf", "mine"), {"mine": mine})
    assert named_estimators(mine) == (("mine",), {"mine": mine})
    assert named_estimators({"a": mine, "ekf": "ekf"}) == (("a", "ekf"), {"a": mine})
    assert named_estimators([ekf.joint_ekf]) == (("joint-ekf",), {})
    (tmp_path / "filters.py").write_text("def solve(problem, progress=None): ...\n")
    names, functions = named_estimators({"theirs": f"{tmp_path / 'filters.py'}:solve", "isam2": "isam2"})
    assert names == ("theirs", "isam2")
    assert functions["theirs"](None) is None


def test_a_function_is_a_row_with_its_measured_time_and_a_crash_is_a_row_with_its_reason(sequence: Sequence) -> None:
    def crash(problem: Problem, progress: object = None) -> Estimate:
        raise ValueError("no luck")

    found = fgbaseline.run(sequence, estimators=["dead-reckoning", mine, crash], as_recorded=True)
    assert list(found.table.columns) == ["dead-reckoning", "mine", "crash"]
    assert found.table.loc["runtime: time, s", "mine"] > 0.0
    assert found.table["crash"].isna().all()
    assert "no luck" in found.results["crash"].estimate.reason
    assert len(repr(found).splitlines()) <= 5
    assert "crash" in found._repr_html_()


def test_a_problem_is_solved_as_it_is_posed(result: RunReport) -> None:
    again = fgbaseline.run(result.problem, estimators=NAMES)
    assert again.problem is result.problem
    for name in NAMES:
        ours, theirs = (run.results[name].estimate.world_T_imu for run in (again, result))
        np.testing.assert_array_equal(ours, theirs)


def test_truth_and_added_trajectories_may_be_arrays(sequence: Sequence) -> None:
    truth = sequence.truth
    assert truth is not None
    bare = Sequence(**{f.name: None if f.name == "truth" else getattr(sequence, f.name) for f in fields(sequence)})
    camera = truth.world_T_imu @ sequence.imu_T_cam
    options: dict[str, Any] = {"estimators": "dead-reckoning", "as_recorded": True}
    expected = fgbaseline.run(sequence, **options).table
    forms: list[tuple[Any, Any]] = [
        (truth, None),
        (truth.world_T_imu, "imu"),
        (camera, "camera"),
        ((sequence.t, camera), "camera"),
    ]
    for given, frame in forms:
        found = fgbaseline.run(bare, truth=given, truth_frame=frame, **options).table.drop(index="runtime: time, s")
        pd.testing.assert_frame_equal(found, expected.drop(index="runtime: time, s"), rtol=1e-6, atol=1e-9)
    turned = se3.exp([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]) @ truth.world_T_imu
    added = fgbaseline.run(sequence, add={"true": (sequence.t, turned)}, **options)
    assert added.table.loc["ATE: RMSE, aligned, m", "true"] < 1e-6


def test_arguments_are_left_as_they_were(result: RunReport) -> None:
    t, poses = result.problem.sequence.t.copy(), result.results["mine"].estimate.world_T_imu.copy()
    before = t.tobytes(), poses.tobytes()
    fgbaseline.compare_trajectories((t, poses), {"a": (t, poses)}, align="sim3", offset=0.0)
    assert (t.tobytes(), poses.tobytes()) == before
    assert t.flags.writeable
    assert poses.flags.writeable


Call = Callable[[Sequence, Estimate], object]
run: Callable[..., Any] = fgbaseline.run
compare: Callable[..., Any] = fgbaseline.compare_trajectories
BAD: dict[str, Call] = {
    r"nothing\.npz: there is no such file": lambda s, e: run("nothing.npz"),
    "recording: expected a file, a Sequence or a Problem, got int": lambda s, e: run(3),
    "preset: expected 'calibrated' or 'documented', got 'best'": lambda s, e: run(s, preset="best"),
    "estimators: there is no 'nothing'": lambda s, e: run(s, estimators=["nothing"]),
    "estimators: .* has no name": lambda s, e: run(s, estimators=lambda problem: problem),
    "estimators: 'ekf' is installed already": lambda s, e: run(s, estimators={"ekf": mine}),
    "estimators: expected names and functions, got int": lambda s, e: run(s, estimators=3),
    "truth: the body of the poses .*; add truth_frame camera or imu": lambda s, e: run(s, truth=np.eye(4)[None]),
    "truth_frame: 'imu' is given without": lambda s, e: run(s, truth_frame="imu"),
    "held_out: expected a share": lambda s, e: run(s, held_out=2.0),
    "features: expected a number of at least 1": lambda s, e: run(s, features=0),
    "seed: expected a whole number from 0": lambda s, e: run(s, seed=-1),
    "time_unit: it is for a recording in a file": lambda s, e: run(s, time_unit="ms"),
    "add: the name 'ekf' is taken": lambda s, e: run(s, add={"ekf": e}),
    "align: expected 'none', .* or 'sim3', got 'best'": lambda s, e: compare(e, e, align="best"),
    r"a: expected poses \(T, 4, 4\), .* got \(3, 3\)": lambda s, e: compare(e, {"a": np.eye(3)}),
    r"a: expected stamps \(n,\) .* got \(3,\)": lambda s, e: compare(e, {"a": (np.arange(3), np.eye(3)[:2])}),
    "trajectory: expected a file, .* got int": lambda s, e: compare(e, [3]),
    "there is nothing to compare": lambda s, e: compare(e, []),
    "it has no time stamps, .* add times FILE, or sequence": lambda s, e: compare((s.t, e.world_T_imu), e),
    "held_out: the tracks come from": lambda s, e: compare(e, e, held_out=0.2),
    "delta: expected a length": lambda s, e: compare(e, e, deltas=["10"]),
    "sequence: expected a file": lambda s, e: compare(e, e, sequence=4),
    "times: expected files": lambda s, e: compare(e, e, times=4),
    r"extrinsic: expected imu_T_cam \(4, 4\)": lambda s, e: compare(e, e, extrinsic=np.eye(3)),
    "x: the estimator failed": lambda s, e: compare(e, Estimate.failed("x", "why", 2, 0)),
}


@pytest.mark.parametrize("sentence", BAD)
def test_what_is_wrong_is_one_sentence_in_the_names_of_python(
    sentence: str, sequence: Sequence, result: RunReport
) -> None:
    with pytest.raises(InputError, match=sentence) as raised:
        BAD[sentence](sequence, result.results["mine"].estimate)
    assert "\n" not in str(raised.value)
    assert "--" not in str(raised.value)


@pytest.mark.parametrize("preset", ["features", "as_recorded", "held_out", "preset"])
def test_a_setting_of_the_problem_is_refused_where_one_is_posed(preset: str, result: RunReport) -> None:
    values: dict[str, Any] = {"features": 10, "as_recorded": True, "held_out": 0.2, "preset": "documented"}
    with pytest.raises(InputError, match=f"^{preset}: the problem is posed already"):
        fgbaseline.run(result.problem, **{preset: values[preset]})


def test_options_of_the_command_become_keywords() -> None:
    assert in_python("held-out: give --time-unit or --force") == "held_out: give time_unit or force=True"
    assert in_python("a-b.tum: a well-known file - give --align se3") == "a-b.tum: a well-known file - give align se3"


def displayed(of: object, found: dict[str, object]) -> dict[str, object]:
    """One instance of each dataclass with arrays or tables that can be reached from an object."""
    if isinstance(of, dict):
        for value in of.values():
            displayed(value, found)
    elif is_dataclass(of) and type(of).__qualname__ not in found:
        found[type(of).__qualname__] = of
        for field in fields(of):
            displayed(getattr(of, field.name), found)
    return found


def test_nothing_prints_more_than_five_lines(result: RunReport) -> None:
    comparison = fgbaseline.compare_trajectories(result, {"again": result.results["ekf"].estimate})
    path = data.Trajectory(result.problem.sequence.t, result.results["ekf"].estimate.world_T_imu)
    found: dict[str, object] = {}
    for start in (result, comparison, path):
        displayed(start, found)
    assert {"RunReport", "ComparisonReport", "Problem", "Sequence", "Estimate", "Trajectory", "Result"} <= set(found)
    for name, one in found.items():
        lines = repr(one).splitlines()
        assert len(lines) <= 5, name
        assert len(repr(one)) <= 700, name


def test_html_is_one_table_and_escapes_what_comes_from_files(sequence: Sequence, result: RunReport) -> None:
    named = Sequence(**{f.name: "<b>&" if f.name == "name" else getattr(sequence, f.name) for f in fields(sequence)})
    assert "&lt;b&gt;&amp;" in named._repr_html_()
    found = fgbaseline.compare_trajectories(result, {"<i>": result.results["ekf"].estimate})
    for html in (found._repr_html_(), result._repr_html_(), result.problem._repr_html_(), sequence._repr_html_()):
        assert html.count("<table>") == html.count("</table>") == 1
        assert "<i>" not in html


def test_tables_have_one_metric_a_row(result: RunReport) -> None:
    assert list(result.table.columns) == [*NAMES, "mine"]
    assert result.table.index.is_unique
    summary = result.summary.estimators["ekf"]
    assert summary.divergence is not None
    assert result.table.loc["divergence: RMSE, m", "ekf"] == summary.divergence.rmse
    assert result.text_table.rows[0].group
    pd.testing.assert_frame_equal(result.to_frame(), result.table)
    titles = {f"{row.group}: {row.name}" for row in result.text_table.rows}
    assert len(titles) == len(result.table)


def test_frames_of_a_recording_a_problem_and_an_estimate_hold_their_arrays(result: RunReport) -> None:
    problem, estimate = result.problem, result.results["isam2"].estimate
    frame = problem.sequence.to_frame()
    np.testing.assert_array_equal(frame[["vx", "vy", "vz"]], problem.sequence.linear_velocity)
    assert frame["observations"].sum() == len(problem.sequence.observations)
    observations = problem.to_frame()
    np.testing.assert_array_equal(observations["excluded"] == "", problem.mask)
    np.testing.assert_array_equal(observations[["uL", "vL", "uR", "vR"]], problem.sequence.observations.pixel)
    path = estimate.to_frame()
    np.testing.assert_array_equal(path[["x", "y", "z"]], estimate.world_T_imu[:, :3, 3])
    assert estimate.covariance is not None
    trace = (path[["sx", "sy", "sz"]] ** 2).sum(axis=1)
    np.testing.assert_allclose(trace, np.einsum("nii->n", estimate.covariance[:, :3, :3]), atol=1e-12)
    assert list(estimate.landmarks.to_frame().index) == estimate.landmarks.index.tolist()
    trajectory = data.Trajectory(problem.sequence.t, estimate.world_T_imu)
    np.testing.assert_array_equal(trajectory.to_frame()["t"], problem.sequence.t)


def test_plots_show_the_arrays(result: RunReport) -> None:
    from matplotlib import pyplot as plt

    plt.switch_backend("agg")
    problem, estimate = result.problem, result.results["isam2"].estimate
    axes = estimate.plot()
    assert result.results["ekf"].estimate.plot(axes) is axes
    names = [axes.get_xlabel()[0], axes.get_ylabel()[0]]
    extent = np.ptp(estimate.world_T_imu[:, :3, 3], axis=0)
    assert set(np.argsort(extent)[-2:]) == {"xyz".index(name) for name in names}
    drawn = np.column_stack(axes.lines[0].get_data())
    np.testing.assert_array_equal(drawn, estimate.world_T_imu[:, ["xyz".index(name) for name in names], 3])
    used = problem.plot().axes[0].lines[1].get_ydata()
    assert np.sum(used) == problem.mask.sum()
    assert [a.get_ylabel() for a in problem.sequence.plot().axes] == ["speed, m/s", "turn rate, °/s", "observations"]
    plt.close("all")


def test_figures_are_by_name_and_plot_is_that_of_the_paths(result: RunReport) -> None:
    found: ComparisonReport = fgbaseline.compare_trajectories(result, result.results["ekf"].estimate)
    assert "paths" in found.figures()
    assert found.plot().axes
    figures = result.figures()
    assert {"paths_overlaid", "divergence"} <= set(figures)
    assert all(figure.axes for figure in figures.values())


def test_a_notebook_displays_each_figure_once(result: RunReport, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its backend, once loaded, displays all values of cells, and at the end of a cell all figures of pyplot."""
    from matplotlib import get_backend
    from matplotlib import pyplot as plt

    plt.switch_backend("agg")
    loaded: list[str] = []
    monkeypatch.setattr(plt, "switch_backend", loaded.append)
    monkeypatch.setitem(sys.modules, "ipykernel", ModuleType("ipykernel"))
    for plot in (result.plot, result.problem.plot, result.problem.sequence.plot):
        loaded.clear()
        assert plot().axes
        assert set(loaded) == {get_backend()}
        assert plt.get_fignums() == []
