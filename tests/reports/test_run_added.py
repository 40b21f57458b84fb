"""A user's function from a file, and a trajectory file, beside the estimators of a run."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fgbaseline
from fgbaseline import data
from fgbaseline.data.estimators.user_estimator import load_all
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.geometry import FloatArray, InputError, se3
from fgbaseline.reports.comparison import compare
from fgbaseline.reports.problem.construction import build_problem
from fgbaseline.reports.problem.settings import RunSettings
from fgbaseline.reports.run.estimation import read_added, solve
from fgbaseline.reports.run.folder import write_run

from ..builders.browser import Opened

MINE = '''
from fgbaseline import data
def solve(problem, progress=None):
    """My own."""
    answer = data.find_estimator("dead-reckoning")(problem, progress)
    return answer
'''
SETTINGS = RunSettings(estimators=("dead-reckoning", "ekf"), as_recorded=True)


@pytest.fixture(scope="module")
def problem() -> data.Problem:
    return build_problem(simulate(Simulation(duration=3.0, features_per_frame=10.0, seed=4)), SETTINGS)


def rotated(problem: data.Problem, axis: FloatArray, degrees: float, place: Path) -> str:
    """File of the dead-reckoned path in a world that is turned about an axis, and 5 m away."""
    poses = data.find_estimator("dead-reckoning")(problem, None).world_T_imu
    motion = se3.exp(np.concatenate([np.zeros(3), np.deg2rad(degrees) * axis]))
    motion[:3, 3] = [5.0, 3.0, 1.0]
    data.write_tum(place, problem.sequence.t, motion @ poses)
    return f"mine={place}"


def test_a_function_of_a_file_is_solved_beside_the_installed_ones(problem: data.Problem, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    functions = load_all((f"{file}:solve",))
    run = solve(problem, replace(SETTINGS, estimators=("dead-reckoning", "ekf", "solve"), functions=functions))
    assert list(run.results) == ["dead-reckoning", "ekf", "solve"]
    ours, mine = run.results["dead-reckoning"].estimate, run.results["solve"].estimate
    np.testing.assert_array_equal(mine.world_T_imu, ours.world_T_imu)
    assert run.settings["functions"] == f"solve={file}:solve"


def test_an_added_trajectory_has_the_error_that_compare_gives_it(problem: data.Problem, tmp_path: Path) -> None:
    given = rotated(problem, problem.sequence.up, 40.0, tmp_path / "path.tum")
    settings = replace(SETTINGS, add=(given,))
    run = solve(problem, settings, added=read_added(settings))
    assert "yaw and position aligned" in run.added["mine"]
    folder = tmp_path / "run"
    folder.mkdir()
    summary = write_run(run, folder)
    assert summary.estimators["mine"].divergence is not None
    there = compare(folder, given, align="yaw", beside="none").results["mine"]
    assert summary.estimators["mine"].divergence.rmse == pytest.approx(there.rmse, rel=1e-6)
    assert summary.estimators["mine"].seconds is None
    assert run.added["mine"] in (folder / "report.html").read_text().replace("&#39;", "'")
    assert "mine" in run.unranked


def test_a_user_function_and_an_added_path_are_clicked_on_the_page(
    chromium: Any, problem: data.Problem, tmp_path: Path
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    given = rotated(problem, problem.sequence.up, 40.0, tmp_path / "path.tum")
    result = fgbaseline.run(problem, estimators=["ekf", "dead-reckoning", f"my-filter={file}:solve"], add=given)
    page = result.report(tmp_path / "page.html")
    assert sorted(place.name for place in tmp_path.iterdir()) == ["mine.py", "page.html", "path.tum"]
    opened = Opened(chromium, page.as_uri())
    assert result.added["mine"] in opened.text("#table")
    assert [opened.text(f"#table tbody tr:nth-child({i}) th") for i in (3, 4)] == ["my-filter", "mine"]
    for i in (2, 3):
        line = f".line.estimator-{i}"
        assert opened.count(f"#path-view {line}") == 1
        assert opened.count(f"#over-time {line}") > 3
        opened.page.uncheck(f'#estimators-shown input[value="{i}"]')
        assert opened.count(line) == 0
        opened.page.check(f'#estimators-shown input[value="{i}"]')
    assert (opened.said, opened.asked) == ([], [page.as_uri()])
    opened.context.close()


def test_a_world_that_is_not_level_is_aligned_in_six_degrees_of_freedom(problem: data.Problem, tmp_path: Path) -> None:
    across = np.cross(problem.sequence.up, [0.3, 0.9, 0.1])
    given = rotated(problem, across / np.linalg.norm(across), 20.0, tmp_path / "path.tum")
    settings = replace(SETTINGS, add=(given,))
    run = solve(problem, settings, added=read_added(settings))
    assert "SE(3)-aligned" in run.added["mine"]
    assert "20.0° off" in run.added["mine"]


def test_what_cannot_be_aligned_is_a_row_with_its_reason(problem: data.Problem, tmp_path: Path) -> None:
    data.write_tum(tmp_path / "late.tum", problem.sequence.t + 1e4, np.repeat(np.eye(4)[None], problem.n_frames, 0))
    settings = replace(SETTINGS, add=(str(tmp_path / "late.tum"),))
    run = solve(problem, settings, added=read_added(settings))
    assert run.results["late"].estimate.status is data.Status.FAILED
    assert "late.tum is within 0.01 s of one of ekf" in run.results["late"].estimate.reason
    assert run.results["ekf"].answered


def test_a_name_that_is_taken_and_options_without_a_file_are_bad_input(problem: data.Problem, tmp_path: Path) -> None:
    rotated(problem, problem.sequence.up, 0.0, tmp_path / "ekf.tum")
    with pytest.raises(InputError, match="the name 'ekf' is taken"):
        read_added(replace(SETTINGS, add=(str(tmp_path / "ekf.tum"),)))
    with pytest.raises(InputError, match="without a trajectory"):
        read_added(replace(SETTINGS, add_offset=1.0))
