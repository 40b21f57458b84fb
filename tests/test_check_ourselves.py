"""`make quick` guards our own accuracy: what is committed holds, and a Jacobian of the wrong sign does not get by."""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fgbaseline.data import Estimate, Problem, read
from fgbaseline.ekf import joint_filter, slam
from fgbaseline.ekf.pose_update import PoseInnovation
from fgbaseline.ekf.stereo_rows import Sight
from fgbaseline.geometry import StereoCamera
from fgbaseline.reports import job
from fgbaseline.reports.checking.command import Outputs, check
from fgbaseline.reports.comparison import compare_all
from fgbaseline.reports.solving import solve_all
from fgbaseline.reports.summary import summarise

from .commands import fgbaseline

ROOT = Path(__file__).parents[1]
SUITES = ROOT / "suites"


def in_makefile(variable: str) -> str:
    """What the Makefile gives to `make quick`."""
    found = re.search(rf"^{variable} := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert found is not None
    return found[1]


@dataclass(frozen=True)
class Quick:
    """The problem of `make quick`, and the answers to it."""

    problem: Problem
    answers: Mapping[str, Estimate]
    folder: Path

    def check(self, other: Mapping[str, Estimate]) -> int:
        """The exit code with some answers replaced, against what is committed."""
        answers = {**self.answers, **other}
        summary = summarise(compare_all(self.problem, answers, {}))
        text = json.dumps(summary.model_dump(mode="json", by_alias=True))
        (self.folder / job.MARK).write_text(text)
        return check(self.folder, SUITES / "quick-limits.toml", SUITES / "quick-baseline.json", Outputs())


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Quick:
    folder = tmp_path_factory.mktemp("quick")
    simulated = fgbaseline("simulate", "quick.npz", *in_makefile("QUICK_DRIVE").split(), cwd=folder)
    assert simulated.returncode == 0, simulated.stderr
    estimators = tuple(in_makefile("QUICK_ESTIMATORS").split(","))
    problem = job.pose_problem(read(folder / "quick.npz"), job.RunSettings(estimators=estimators))
    return Quick(problem, solve_all(problem, estimators), folder)


def test_what_is_committed_holds(quick: Quick) -> None:
    assert quick.check({}) == 0


def pose_jacobian(patch: pytest.MonkeyPatch) -> None:
    """Of the pixels by the pose, equation 13."""
    right = slam.pose_innovation

    def wrong(*arguments: Any) -> PoseInnovation:
        innovation = right(*arguments)
        return innovation._replace(jacobian=-innovation.jacobian)

    patch.setattr(slam, "pose_innovation", wrong)


def camera_jacobian(patch: pytest.MonkeyPatch) -> None:
    """Of the pixels by the point in the camera's frame."""
    right = StereoCamera.jacobian
    patch.setattr(StereoCamera, "jacobian", lambda camera, points: -right(camera, points))


def joint_jacobian(patch: pytest.MonkeyPatch) -> None:
    """Of the three rows by the pose, in the joint filter."""
    right = joint_filter.sight

    def wrong(*arguments: Any) -> Sight:
        seen = right(*arguments)
        return seen._replace(by_pose=-seen.by_pose)

    patch.setattr(joint_filter, "sight", wrong)


@pytest.mark.parametrize(
    ("estimator", "broken"), [("ekf", pose_jacobian), ("ekf", camera_jacobian), ("joint-ekf", joint_jacobian)]
)
def test_a_jacobian_of_the_wrong_sign_does_not_get_by(
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
    short = [row for row in said if row.startswith("falls short")]
    assert any("ate.rmse" in row for row in short)
    assert {row.split()[2] for row in short} == {estimator}
