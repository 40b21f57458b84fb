"""The quick suite guards our own accuracy: what is committed holds, and a wrong sign in a Jacobian does not get by."""

import json
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fgbaseline.compare.estimate_comparison import compare_all
from fgbaseline.data import Estimate, Problem
from fgbaseline.data.estimators.runner import solve_all
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.ekf import decoupled_ekf
from fgbaseline.ekf.pose_update import PoseInnovation
from fgbaseline.geometry import StereoCamera
from fgbaseline.geometry.linearization import Prediction
from fgbaseline.reports.problem.construction import build_problem
from fgbaseline.reports.problem.settings import RunSettings
from fgbaseline.reports.results.json_files import SUMMARY
from fgbaseline.reports.results.run import summarize

from ..builders.commands import fgbaseline
from ..builders.summaries import check_files

ROOT = Path(__file__).parents[2]
SUITES = ROOT / "suites"


BASELINE = SUITES / "quick-baseline.json"
RUN, SEED = "town seed=3", 3
"""of the suite: the one that is solved with a wrong Jacobian"""


@dataclass(frozen=True)
class Quick:
    """The problem of one run of the suite, and the answers to it."""

    problem: Problem
    answers: Mapping[str, Estimate]
    folder: Path

    def check(self, other: Mapping[str, Estimate]) -> int:
        """The exit code with some answers replaced, against what is committed."""
        answers = {**self.answers, **other}
        summary = summarize(compare_all(self.problem, answers, {}))
        text = json.dumps(summary.model_dump(mode="json", by_alias=True))
        (self.folder / SUMMARY).write_text(text)
        return check_files(self.folder, SUITES / "quick-limits.toml", self.folder / BASELINE.name)


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Quick:
    folder = tmp_path_factory.mktemp("quick")
    suite = tomllib.loads((SUITES / "quick.toml").read_text())
    (town,) = (sequence for sequence in suite["sequence"] if RUN.startswith(sequence["name"]))
    sequence = simulate(Simulation(**town["simulate"], seed=SEED))
    baseline = json.loads(BASELINE.read_text())
    alone = {**baseline, "runs": {sequence.name: baseline["runs"][RUN]}}
    (folder / BASELINE.name).write_text(json.dumps(alone))
    estimators = tuple(suite["estimators"])
    problem = build_problem(sequence, RunSettings(estimators=estimators))
    return Quick(problem, solve_all(problem, estimators), folder)


@pytest.mark.slow
def test_the_quick_suite_holds_on_two_seeds_of_four(tmp_path: Path) -> None:
    suite = (SUITES / "quick.toml").read_text()
    assert suite.count("seeds = { count = 4 }") == 2
    (tmp_path / "suite.toml").write_text(suite.replace("seeds = { count = 4 }", "seeds = { count = 2 }"))
    ran = fgbaseline("bench", "suite.toml", "--out", "out", "--workers", "1", cwd=tmp_path, drawing=False)
    assert ran.returncode == 0, ran.stderr
    baseline = json.loads(BASELINE.read_text())
    runs = {name: values for name, values in baseline["runs"].items() if name.endswith(("seed=0", "seed=1"))}
    assert len(runs) == 4
    (tmp_path / BASELINE.name).write_text(json.dumps({**baseline, "runs": runs}))
    assert check_files(tmp_path / "out", SUITES / "quick-limits.toml", tmp_path / BASELINE.name) == 0


def test_one_run_of_it_holds(quick: Quick) -> None:
    assert quick.check({}) == 0


def pose_jacobian(patch: pytest.MonkeyPatch) -> None:
    """Of the pixels by the pose, equation 13."""
    right = decoupled_ekf.pose_innovation

    def wrong(*arguments: Any) -> PoseInnovation:
        innovation = right(*arguments)
        return innovation._replace(jacobian=-innovation.jacobian)

    patch.setattr(decoupled_ekf, "pose_innovation", wrong)


def camera_jacobian(patch: pytest.MonkeyPatch) -> None:
    """Of the pixels by the point in the camera's frame."""
    right = StereoCamera.row_derivatives
    patch.setattr(StereoCamera, "row_derivatives", lambda camera, seen, along: -right(camera, seen, along))


def joint_jacobian(patch: pytest.MonkeyPatch) -> None:
    """Of the three rows by the pose, in the joint filter."""
    right = Prediction.pose_jacobian
    patch.setattr(Prediction, "pose_jacobian", lambda seen: -right(seen))


@pytest.mark.parametrize(
    ("estimator", "broken"), [("ekf", pose_jacobian), ("ekf", camera_jacobian), ("joint-ekf", joint_jacobian)]
)
def test_a_jacobian_of_the_wrong_sign_fails_the_check(
    estimator: str,
    broken: Callable[[pytest.MonkeyPatch], None],
    quick: Quick,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with monkeypatch.context() as patch:
        broken(patch)
        answer = solve_all(quick.problem, [estimator])
    assert quick.check(answer) == 1
    said = capsys.readouterr().out.splitlines()
    short = [row for row in said if row.startswith("violated")]
    assert any("ate.rmse" in row for row in short)
    assert {row.split()[1] for row in short} == {estimator}
